# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens that cross themselves more than their keys do: where they do, and how far around the re-solve reaches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array

from ..arrays import Bools, Floats, Ints
from ..keys.keypair import KeyPair
from ..triangles.topology import sides
from .box_tree import CrowdedError
from .crossings import CrossingSearch

# Stronger anchors fade out over this many rings of neighbors around crossing triangles: an abrupt end would show as a
# crease.
_FADING_RINGS = 4
# How far a vertex may leave the box around its places in the keys: of their distance, and of the size.
_ROOM, _LEAST_ROOM = 0.3, 1e-3


class CrossingLimit:
    """How much a surface may cross itself between two keys: no more than the worse of the keys.

    The crossings of a shape are unknown if so many of its triangles overlap that the search is given up. If that
    happens for a key, they are unknown for all shapes.

    Parameters
    ----------
    faces : (m, 3) int64
        Triangles.
    key0, key1 : (n, 3)
        Positions in the two keys.
    still : (n,) bool
        Vertices that have the same place in both keys and in all shapes.
    search : CrossingSearch, optional
        A search among all triangles of a shape like the keys, which is used if it is of the same triangles.
    """

    def __init__(
        self, faces: Ints, key0: Floats, key1: Floats, still: Bools, search: CrossingSearch | None = None
    ) -> None:
        self._faces = faces
        # Two triangles that do not move cross in all shapes or in none.
        moving = ~still[faces].all(axis=1)
        if search is not None and search.is_of(faces):
            self._search = search.among(moving)
        else:
            self._search = CrossingSearch(faces, (key0, key1), moving)
        # Most shapes lie near the straight lines between the keys, where far fewer triangles can meet.
        room = _ROOM * np.linalg.norm(key1 - key0, axis=1)[:, None] + _LEAST_ROOM * float(np.ptp(key0, axis=0).max())
        self._low, self._high = np.minimum(key0, key1) - room, np.maximum(key0, key1) + room
        self._near = self._search.within(self._low, self._high)
        self._known: Ints | None = None
        self._allowed = 0
        try:
            in_keys = [self._codes(key) for key in (key0, key1)]
        except CrowdedError:
            return
        self._known = np.concatenate(in_keys)
        self._allowed = max(len(codes) for codes in in_keys)

    def excess(self, shape: Floats) -> int | None:
        """How many more pairs of triangles cross in ``shape`` (n, 3) than in the worse key; None if unknown."""
        if self._known is None:
            return None
        try:
            return max(0, len(self._codes(shape)) - self._allowed)
        except CrowdedError:
            return None

    def new_vertices(self, shape: Floats) -> Bools:
        """(n,) whether each vertex belongs to triangles that cross in ``shape`` (n, 3) but in neither key.

        All false if the shape does not cross itself more than the worse key, or if its crossings are unknown.
        """
        found = np.zeros(len(shape), dtype=bool)
        found[self._faces[self.new_pairs(shape)].ravel()] = True
        return found

    def new_pairs(self, shape: Floats) -> Ints:
        """(k, 2) the triangles that cross each other in ``shape`` (n, 3) but in neither key.

        None if the shape does not cross itself more than the worse key, or if its crossings are unknown.
        """
        none = np.empty((0, 2), dtype=np.int64)
        if self._known is None:
            return none
        try:
            codes = self._codes(shape)
        except CrowdedError:
            return none
        if len(codes) <= self._allowed:
            return none
        fresh = codes[~np.isin(codes, self._known)]
        return np.stack([fresh // len(self._faces), fresh % len(self._faces)], axis=1)

    def faded(self, chosen: Bools, rings: int = _FADING_RINGS) -> Floats:
        """(n,) weights that are 1 at the chosen vertices and fall to 0 some rings of neighbors away."""
        edges = sides(self._faces)
        count = len(chosen)
        neighbors = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
        reached = chosen.astype(np.float64)
        total = reached.copy()
        for _ in range(rings):
            reached = np.minimum(reached + neighbors @ reached + neighbors.T @ reached, 1.0)
            total += reached
        return np.asarray(total / (rings + 1))

    @staticmethod
    def left(excess: Sequence[int | None]) -> tuple[int, int]:
        """Badness of several shapes, for comparison: how many are unknown, and the total excess of the others."""
        return excess.count(None), sum(count or 0 for count in excess)

    def _codes(self, shape: Floats) -> Ints:
        """One code for each crossing pair of triangles of which at least one moves."""
        is_near = bool((self._low <= shape).all() and (shape <= self._high).all())
        pairs = (self._near if is_near else self._search).pairs(shape)
        return np.asarray(pairs[:, 0] * len(self._faces) + pairs[:, 1])


class PairCrossings:
    """Counts how much more often shapes between two keys cross themselves than the worse key does.

    Shapes are in the keys' own coordinates, which may be of any size.
    """

    def __init__(self, pair: KeyPair) -> None:
        # Scaled so that cubes of coordinates neither overflow nor underflow; scaling by powers of two is exact.
        size = max(float(np.ptp(0.5 * key, axis=0).max()) for key in (pair.key0, pair.key1))
        self._exponent = -int(np.frexp(size)[1])
        self._origin = np.ldexp(pair.key0[0], self._exponent)
        still = (pair.key0 == pair.key1).all(axis=1)
        self._limit = CrossingLimit(pair.welded_faces, self._scaled(pair.key0), self._scaled(pair.key1), still)

    def excess(self, shape: Floats) -> int | None:
        """How many more pairs of triangles cross in ``shape`` (n, 3) than in the worse key; None if unknown."""
        return self._limit.excess(self._scaled(shape))

    def _scaled(self, positions: Floats) -> Floats:
        return np.asarray(np.ldexp(positions, self._exponent) - self._origin)
