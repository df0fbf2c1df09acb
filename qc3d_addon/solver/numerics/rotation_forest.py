# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Minimum spanning trees of the relative rotations between neighboring elements, and walks along them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from ..arrays import Floats, Ints

_DIGITS = 9  # of angles that are compared: rounding must not choose among equal ones


class RotationForest:
    """Minimum spanning trees of the relative rotations, one for each part: neighbors in a tree turn by similar angles.

    Parameters
    ----------
    turns : (m, 3)
        Rotation vectors of the elements, radians.
    adjacency : (k, 2) int64
        Pairs of neighboring elements.

    Attributes
    ----------
    labels : (m,) int64
        Part of every element.
    roots : (parts,) int64
        The root of each tree, once it is ``rooted``.
    """

    def __init__(self, turns: Floats, adjacency: Ints) -> None:
        count = len(turns)
        first, second = adjacency.T.astype(np.int32)  # scipy before 1.16 accepts no other index type
        # Sparse graphs drop edges of cost zero.
        cost = np.round(relative_angles(turns[first], turns[second]), _DIGITS) + 10.0**-_DIGITS
        tree = minimum_spanning_tree(coo_array((cost, (first, second)), shape=(count, count)).tocsr())
        self.labels: Ints = np.asarray(connected_components(tree, directed=False)[1], dtype=np.int64)
        self._edges: list[Ints] = [end.astype(np.int64) for end in tree.nonzero()]

    def rooted(self, angles: Floats) -> RotationForest:
        """The same trees, each rooted at the element with the smallest of ``angles`` (m,)."""
        other = copy.copy(self)
        other._root(angles)
        return other

    def _root(self, angles: Floats) -> None:
        count, labels = len(angles), self.labels
        by_angle = np.lexsort((np.round(angles, _DIGITS), labels))
        self.roots: Ints = by_angle[np.searchsorted(labels[by_angle], np.arange(labels.max() + 1))]
        # An extra node joins all roots, so that one breadth-first search covers every part.
        rows, columns = self._edges
        rows = np.concatenate([rows, np.full(len(self.roots), count)])
        columns = np.concatenate([columns, self.roots])
        joined = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1)).tocsr()
        order, self._parents = (found.astype(np.int64) for found in breadth_first_order(joined, count, directed=False))
        depth = _depths(order, self._parents)
        self._by_depth = order[np.argsort(depth[order], kind="stable")]
        self._starts = np.searchsorted(depth[self._by_depth], np.arange(2, depth.max() + 2))

    def carried(self, values: Floats, align: Callable[[Floats, Floats], Floats]) -> Floats:
        """Walk outward from the roots, level by level, aligning each value with that of its parent."""
        result = values.copy()
        every = self._by_depth[self._starts[0] :]
        if np.array_equal(align(values[every], values[self._parents[every]]), values[every]):
            return result  # each agrees with its parent as it is
        for begin, end in pairwise(self._starts):
            members = self._by_depth[begin:end]
            result[members] = align(values[members], result[self._parents[members]])
        return result


def _depths(order: Ints, parents: Ints) -> Ints:
    """Depth of every node in the tree, by pointer doubling; ``order`` is breadth-first."""
    ancestor = parents.copy()
    ancestor[order[0]] = order[0]
    depth = np.ones(len(parents), dtype=np.int64)
    depth[order[0]] = 0
    while True:
        further = depth[ancestor]
        if not further.any():
            return depth
        depth = depth + further
        ancestor = ancestor[ancestor]


def relative_angles(first: Floats, second: Floats) -> Floats:
    """(k,) angles between the rotations of two lists of rotation vectors, from their quaternions."""
    scalars, vectors = zip(*(_half_angle(vector) for vector in (first, second)), strict=True)
    inner = scalars[0] * scalars[1] + np.einsum("ki,ki->k", vectors[0], vectors[1])
    return np.asarray(2.0 * np.arccos(np.clip(np.abs(inner), 0.0, 1.0)))


def _half_angle(vectors: Floats) -> tuple[Floats, Floats]:
    half = 0.5 * np.linalg.norm(vectors, axis=1)
    return np.cos(half), 0.5 * np.sinc(half / np.pi)[:, None] * vectors
