# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The prepared maps of a bake: those kept with the keys where they still fit, made anew where not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ..solver.errors import naming_pair
from .mesh_data import Ends
from .records import KeptMap, Record

if TYPE_CHECKING:
    from ..solver.keypair import KeyPair
    from ..solver.pipeline import Progress
    from ..solver.prepared import PreparedMap
    from ..solver.settings import Settings

OnProgress = Callable[["Progress"], None]


@dataclass(frozen=True)
class PairMap:
    """The map of one pair, ready to use and as what is kept of it."""

    prepared: PreparedMap
    kept: KeptMap
    data: bytes


def maps_of_pairs(
    keys: bpy.types.Key,
    pairs: dict[Ends, KeyPair],
    settings: Settings,
    on_progress: OnProgress | None,
    kept_in: Record | None,
) -> dict[Ends, PairMap]:
    """The map of each pair; what was made from exactly these keys and settings before is not made again.

    Parameters
    ----------
    keys
        The mesh's shape keys, which the maps are kept with.
    pairs
        The pairs by their names.
    settings
        The solver's settings.
    on_progress
        Told about the progress of each map that has to be made.
    kept_in
        The record of the maps that may be used again, or None to make all of them anew.

    Raises
    ------
    QC3DError
        If a kept map is damaged, or no map is found.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ..solver import storage
    from ..solver.pipeline import finish, prepare

    names = list(dict.fromkeys(name for ends in pairs for name in ends))
    maps = {}
    for ends, pair in pairs.items():
        # The mode and the easing are no part of it: one map serves them all.
        kept = KeptMap(*ends, f"{storage.fingerprint(pair)} {settings.preparation}")
        data = None if kept_in is None else kept_in.kept_map(keys, kept)
        with naming_pair(*ends, names):
            if data is None:
                prepared = finish(prepare(pair, settings), on_progress)
                data = storage.to_bytes(prepared)
            else:
                prepared = storage.from_bytes(data, pair)
        maps[ends] = PairMap(prepared, kept, data)
    return maps
