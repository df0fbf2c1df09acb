# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mode ``straight``: every vertex moves along a straight line; it works even where no map of a volume exists."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from ..arrays import Floats
from ..collision.colliders import CollisionResolver
from ..collision.self_crossings import PairCrossings
from ..keys.keypair import KeyPair
from .frame import Frame


class StraightFrames:
    """Frames of a pair of keys without a fit; collisions are resolved vertex by vertex."""

    notes: tuple[str, ...] = ()

    def __init__(self, pair: KeyPair) -> None:
        self._pair = pair
        self._still = (pair.key0 == pair.key1).all(axis=1)
        self._crossings = PairCrossings(pair)

    def frames(self, times: Floats, resolver: CollisionResolver | None = None) -> Generator[float, None, list[Frame]]:
        """One frame for each of ``times`` (k,) in 0..1, out of colliders; yields the finished share, 0..1."""
        made = []
        pair = self._pair
        for index, time in enumerate(times.tolist()):
            yield index / len(times)
            positions = pair.key1 if time == 1.0 else _blended(pair.key0, pair.key1, time)
            if resolver is not None:
                positions = resolver.cleared(index, positions, time, self._still)
            made.append(Frame(positions, self._crossings.excess(positions)))
        return made


def _blended(key0: Floats, key1: Floats, time: float) -> Floats:
    """(n, 3) positions on straight lines; equal coordinates stay equal bit for bit, and nothing overflows."""
    half = time * (key1 / 2.0 - key0 / 2.0)
    return np.asarray(key0 + half + half)
