# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The maps of a bake in a file of their own, for the same mesh in another .blend file."""

from __future__ import annotations

from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...solver.errors import InputError, naming_pair
from ..kinds import keys_of
from ..store import checks, mesh_data
from ..store.chain import Chain
from ..store.records import Record
from .plan import kept_map
from .plan_again import request_again

if TYPE_CHECKING:
    from ...solver.fit.files import KeptMaps


def save_maps(obj: bpy.types.Object, chain: Chain, path: Path) -> int:
    """Write the maps that a chain was baked from; returns their number.

    Raises
    ------
    InputError
        If the keys were changed since, so that the map no longer matches them, or the file cannot be written.
    """
    from ...solver.fit.files import KeptMaps, write_maps
    from ...solver.fit.storage import why_unusable
    from ...solver.frames.modes import needs_fits

    keys = keys_of(checks.require_object(obj))
    record = Record.read(keys)
    request = request_again(obj, chain)
    if not needs_fits(request.frame_options.mode):
        raise InputError("Mode straight makes no map; bake in another mode to have one.")
    maps = {}
    for ends, pair in mesh_data.read_pairs(obj, chain.through, chain.base).items():
        data = record.kept_map(keys, kept_map(ends, pair, request.fit_options))
        if data is None or why_unusable(data) is not None:
            raise InputError(f"The map from '{ends[0]}' to '{ends[1]}' no longer matches the keys; re-bake first.")
        maps[ends] = data
    write_maps(path, KeptMaps(chain.through, request.fit_options, maps))
    return len(maps)


def load_maps(obj: bpy.types.Object, path: Path) -> KeptMaps:
    """Keep the maps of a file with the shape keys they belong to, for later bakes.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, or belongs to other keys or another mesh; nothing is changed then.
    """
    from ...solver.fit.files import read_maps
    from ...solver.fit.storage import from_bytes

    keys = keys_of(checks.require_object(obj))
    record = Record.read(keys)
    read = read_maps(path)
    for name in read.through:
        if name not in keys.key_blocks:
            raise InputError(f"{path.name} has maps for '{name}', but '{obj.name}' has no shape key of that name.")
    pairs = mesh_data.read_pairs(obj, read.through)
    for ends in pairwise(read.through):
        with naming_pair(*ends, read.through):
            from_bytes(read.maps[ends], pairs[ends])
    with ExitStack() as undo:
        for ends, data in read.maps.items():
            record.keep_map(keys, kept_map(ends, pairs[ends], read.options), data, undo)
        record.write(keys, undo)
        undo.pop_all()
    return read
