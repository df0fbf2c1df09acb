# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens that cross themselves more than their keys do: where, and how far around the cure should reach."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array

from ..arrays import Bools, Floats, Ints
from ..keys.keypair import KeyPair
from ..triangles.topology import sides
from .box_tree import CrowdedError
from .crossings import CrossingSearch

# The cure fades over so many rings of neighbours around the crossing triangles.
_FADING_RINGS = 4


class CrossingLimit:
    """How much a surface may cross itself between its keys: no more than the worse of them.

    Nothing is known of shapes in which so many triangles lie over each other that the search is given up, and of none
    where that is a key.

    Parameters
    ----------
    faces : (m, 3) int64
    key0, key1 : (n, 3)
    still : (n,) bool
        Vertices that are in the same place in both keys and all shapes.
    """

    def __init__(self, faces: Ints, key0: Floats, key1: Floats, still: Bools) -> None:
        self._faces = faces
        # Where neither triangle moves, nothing changes between the keys.
        self._search = CrossingSearch(faces, (key0, key1), ~still[faces].all(axis=1))
        self._known: Ints | None = None
        self._allowed = 0
        try:
            in_keys = [self._codes(key) for key in (key0, key1)]
        except CrowdedError:
            return
        self._known = np.concatenate(in_keys)
        self._allowed = max(len(codes) for codes in in_keys)

    def excess(self, shape: Floats) -> int | None:
        """Crossing pairs of triangles of ``shape`` (n, 3) beyond what the keys have; None where that is not known."""
        if self._known is None:
            return None
        try:
            return max(0, len(self._codes(shape)) - self._allowed)
        except CrowdedError:
            return None

    def new_vertices(self, shape: Floats) -> Bools:
        """(n,) corners of triangles that cross in ``shape`` (n, 3) and in neither key; none within the limit."""
        found = np.zeros(len(shape), dtype=bool)
        if self._known is None:
            return found
        try:
            codes = self._codes(shape)
        except CrowdedError:
            return found
        if len(codes) > self._allowed:
            fresh = codes[~np.isin(codes, self._known)]
            triangles = np.concatenate([fresh // len(self._faces), fresh % len(self._faces)])
            found[self._faces[triangles].ravel()] = True
        return found

    def faded(self, chosen: Bools) -> Floats:
        """(n,) 1 at the chosen vertices, falling to 0 a few rings of neighbours away."""
        edges = sides(self._faces)
        count = len(chosen)
        neighbours = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
        reached = chosen.astype(np.float64)
        total = reached.copy()
        for _ in range(_FADING_RINGS):
            reached = np.minimum(reached + neighbours @ reached + neighbours.T @ reached, 1.0)
            total += reached
        return np.asarray(total / (_FADING_RINGS + 1))

    @staticmethod
    def left(excess: Sequence[int | None]) -> tuple[int, int]:
        """What is left to do in several shapes: in how many nothing is known, and the pairs that cross in the others.

        The smaller, the better.
        """
        return excess.count(None), sum(count or 0 for count in excess)

    def _codes(self, shape: Floats) -> Ints:
        """One number for each crossing pair of triangles of which one moves."""
        pairs = self._search.pairs(shape)
        return np.asarray(pairs[:, 0] * len(self._faces) + pairs[:, 1])


class PairCrossings:
    """How often shapes between two keys cross themselves beyond the worse key, in the keys' coordinates of any size."""

    def __init__(self, pair: KeyPair) -> None:
        # In units in which cubes of coordinates are numbers; powers of two lose nothing.
        size = max(float(np.ptp(0.5 * key, axis=0).max()) for key in (pair.key0, pair.key1))
        self._exponent = -int(np.frexp(size)[1])
        self._origin = np.ldexp(pair.key0[0], self._exponent)
        still = (pair.key0 == pair.key1).all(axis=1)
        self._limit = CrossingLimit(pair.welded_faces, self._scaled(pair.key0), self._scaled(pair.key1), still)

    def excess(self, shape: Floats) -> int | None:
        """Crossing pairs of triangles of ``shape`` (n, 3) beyond what the keys have; None where that is not known."""
        return self._limit.excess(self._scaled(shape))

    def _scaled(self, positions: Floats) -> Floats:
        return np.asarray(np.ldexp(positions, self._exponent) - self._origin)
