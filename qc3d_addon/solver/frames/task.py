# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One piece of work as plain arrays: which keys to go through, which maps are known, which frames are wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..collision.colliders import Collider
from ..errors import naming_pair
from ..fit.storage import from_bytes, to_bytes
from ..keys.keypair import KeyPair
from ..settings import Settings
from ..support.memory import estimated_mb, require_memory
from .chain import Bake, Steps, chain_inbetweens, checked_times, prepare
from .straight import straight_inbetweens

Ends = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Task:
    """What to compute, checked when it is made.

    Parameters
    ----------
    pairs : dict
        The pair of every two keys that follow each other, by their names.
    through : tuple of str
        Names of the keys from the first to the last.
    settings : Settings
    times : (k,)
        Times of the frames, 0 the first key and 1 the last; empty where only the maps are wanted.
    kept : dict
        Stored maps, by the names of their keys, that need not be made again.
    collider : Collider, optional
        What the frames must not touch, at each of the keys ``through``.
    """

    pairs: dict[Ends, KeyPair]
    through: tuple[str, ...]
    settings: Settings
    times: Floats = field(default_factory=lambda: np.empty(0))
    kept: dict[Ends, bytes] = field(default_factory=dict)
    collider: Collider | None = None

    @classmethod
    def of_keys(
        cls,
        shapes: Mapping[str, ArrayLike],
        faces: ArrayLike,
        edges: ArrayLike,
        through: Sequence[str],
        settings: Settings,
        times: Floats | None = None,
        kept: dict[Ends, bytes] | None = None,
    ) -> Task:
        """A task from the shapes (n, 3) of the keys by name, the triangles (m, 3) and the loose edges (e, 2).

        Raises
        ------
        InputError
            If two keys that follow each other cannot be used.
        """
        pairs = {}
        for ends in pairwise(through):
            with naming_pair(*ends, through):
                pairs[ends] = KeyPair.checked(shapes[ends[0]], shapes[ends[1]], faces, edges)
        wanted = np.empty(0) if times is None else np.asarray(times, dtype=np.float64)
        return cls(pairs, tuple(through), settings, wanted, kept or {})

    @property
    def needs_maps(self) -> bool:
        """Whether maps of the volume are wanted: for frames of all modes but ``straight``, or for themselves."""
        return self.settings.mode != "straight" or not len(self.times)

    @property
    def new_maps(self) -> int:
        """How many maps have to be made."""
        return len(self.pairs) - len(self.kept) if self.needs_maps else 0

    def require_memory(self, limit_mb: float) -> None:
        """Raise InputError, before anything is begun, where the work needs more megabytes than this; 0 for no limit."""
        vertices = len(next(iter(self.pairs.values())).key0)
        needed = estimated_mb(vertices, len(self.pairs), len(self.times), self.settings.quality, self.needs_maps)
        if limit_mb:
            require_memory(needed, limit_mb, vertices)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of a task.

    Parameters
    ----------
    maps : dict
        The stored map of every pair by the names of its keys; none where the task needs no maps.
    bake : Bake or None
        The frames; None where none were wanted.
    """

    maps: dict[Ends, bytes]
    bake: Bake | None


def carry_out(task: Task) -> Steps[Outcome]:
    """Make the maps that are missing, then the frames.

    Raises
    ------
    QC3DError
        If a kept map is damaged or belongs to other keys, a map cannot be made, or a time is outside 0..1.
    """
    checked_times(task.times)  # before the slow part
    if not task.needs_maps:
        along = [task.pairs[ends] for ends in pairwise(task.through)]
        return Outcome({}, (yield from straight_inbetweens(along, task.times, task.settings)))
    prepared, maps = {}, {}
    names = list(dict.fromkeys(task.through))
    for ends, pair in task.pairs.items():
        with naming_pair(*ends, names):
            data = task.kept.get(ends)
            if data is None:
                prepared[ends] = yield from prepare(pair, task.settings)
                data = to_bytes(prepared[ends])
            else:
                prepared[ends] = from_bytes(data, pair)
        maps[ends] = data
    bake = None
    if len(task.times):
        bake = yield from chain_inbetweens(
            [prepared[ends] for ends in pairwise(task.through)], task.times, task.settings, task.collider
        )
    return Outcome(maps, bake)
