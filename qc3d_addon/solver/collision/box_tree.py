# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A bounding-volume hierarchy for the triangles of a deforming surface: built once, refitted to every shape."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import QC3DError
from ..triangles.topology import among, distinct

_CHUNK = 500_000  # pairs of boxes compared at once: bounds the memory of a search
# The number of pairs of triangles around a vertex grows with the square of its triangles. For vertices with more
# triangles than this the pairs are not listed; instead the triangles are kept together in the tree and never compared.
_MOST_AROUND_A_VERTEX = 64
# Comparisons that a search may make. Ordinary meshes need 10 to 60 for each triangle.
_LEAST_WORK, _WORK_PER_TRIANGLE = 5_000_000, 1000

Pairs = tuple[Ints, Ints]
Values = TypeVar("Values", Floats, Bools)


class CrowdedError(QC3DError):
    """So many triangles overlap that comparing them all would take too long."""


class Budget:
    """A limit on the work of one search.

    Parameters
    ----------
    triangles : int
        Number of triangles of the surface.

    Attributes
    ----------
    left : int
        Remaining comparisons of two boxes; other work is counted in the same unit.
    """

    def __init__(self, triangles: int) -> None:
        self.left = _LEAST_WORK + _WORK_PER_TRIANGLE * triangles

    def spend(self, work: int) -> None:
        """Deduct work before it is done.

        Raises
        ------
        CrowdedError
            If more than the remaining budget would be spent.
        """
        self.left -= work
        if self.left < 0:
            raise CrowdedError(
                "So many triangles overlap that searching for crossings would take too long; remove repeated triangles."
            )


class TriangleTree:
    """Finds pairs of triangles whose bounding boxes overlap, without most pairs that share a vertex.

    A binary tree of axis-aligned boxes. The nodes of each level are numbered from 0, the children of node i are 2i and
    2i + 1, and only the end of a level may be incomplete. For each shape the boxes are refitted from the leaves up (van
    den Bergen 1997, "Efficient collision detection of complex deformable models using AABB trees").

    Nodes that have a vertex in common overlap in every shape, so that part of the search is done once, when the tree is
    built. What remains for each shape are pairs of nodes without a common vertex whose parents have one, and the
    descendants of such pairs as long as their boxes overlap.

    Parameters
    ----------
    faces : (m, 3) int64
        Triangles.
    shapes : sequence of (n, 3)
        Typical shapes; triangles that are close to each other in all of them share a branch.
    moving : (m,) bool
        Only pairs with at least one of these triangles are searched.
    groups : (m,) int64, optional
        Labels; triangles of the same group are never paired, and -1 means no group. By default, the triangles around
        each vertex with very many triangles form a group.

    Attributes
    ----------
    order : (m,) int64
        The triangle at each leaf.
    """

    def __init__(self, faces: Ints, shapes: Sequence[Floats], moving: Bools, groups: Ints | None = None) -> None:
        groups = _hubs(faces) if groups is None else groups
        places = np.concatenate([shape[faces].mean(axis=1).T for shape in shapes])
        if groups is not None:
            # An extra coordinate separates the groups further than anything else.
            places = np.concatenate([places, 2.0 * np.ptp(places, axis=1).max() * groups[None]])
        self.order = halving_order(places)
        self._moves = [moving[self.order]]
        # For each level, the common group of all triangles below a node, or -1.
        self._groups = None if groups is None else [groups[self.order]]
        touching = _concerned(_around_vertices(faces[self.order]), self._moves[0])
        self._apart: list[Pairs] = []
        while len(self._moves[0]) > 1:
            count = len(self._moves[0])
            self._moves.insert(0, _joined(self._moves[0], np.logical_or, False))
            if self._groups is not None:
                self._groups.insert(0, _common(self._groups[0]))
            above = _unique(touching[0] // 2, touching[1] // 2, len(self._moves[0]))
            self._apart.insert(0, self._wanted(_without(_children(above, count), touching, count), 1))
            touching = above

    def among(self, moving: Bools) -> TriangleTree:
        """The same tree for searches of fewer pairs: those with at least one of the triangles ``moving`` (m,)."""
        fewer = copy.copy(self)
        fewer._moves = [moving[self.order]]
        for _ in self._apart:
            fewer._moves.insert(0, _joined(fewer._moves[0], np.logical_or, False))
        fewer._apart = [fewer._wanted(pairs, level) for level, pairs in enumerate(self._apart, start=1)]
        return fewer

    def within(self, low: Floats, high: Floats) -> TriangleTree:
        """The same tree, faster, for shapes whose leaves' boxes lie in the boxes with the corners (3, m)."""
        faster = copy.copy(self)
        boxes = self._boxes(low, high)[1:]
        faster._apart = [_meeting(pairs, *level) for pairs, level in zip(self._apart, boxes, strict=True)]
        return faster

    def _wanted(self, pairs: Pairs, level: int) -> Pairs:
        """The pairs of nodes of a level that have moving triangles below them and are not in one group."""
        pairs = _concerned(pairs, self._moves[level])
        if self._groups is None:
            return pairs
        first, second = (self._groups[level][nodes] for nodes in pairs)
        apart = (first != second) | (first < 0)
        return pairs[0][apart], pairs[1][apart]

    def meeting(self, low: Floats, high: Floats, budget: Budget) -> Iterator[Pairs]:
        """Yield, in chunks, the pairs of leaves whose boxes overlap, smaller leaf first.

        Parameters
        ----------
        low, high : (3, m)
            Opposite corners of the leaves' boxes, in the order of the leaves.
        budget : Budget
            Limit on the work.

        Raises
        ------
        CrowdedError
            If the budget is exceeded.
        """
        nothing = np.empty(0, dtype=np.int64)
        yield from self._below(0, (nothing, nothing), self._boxes(low, high), budget, True)

    def _boxes(self, low: Floats, high: Floats) -> list[tuple[Floats, Floats]]:
        """The boxes of the nodes of each level, from the root to the leaves, whose boxes are given."""
        boxes = [(low, high)]
        for _ in self._apart:
            low, high = _joined(low, np.minimum, np.inf), _joined(high, np.maximum, -np.inf)
            boxes.insert(0, (low, high))
        return boxes

    def _below(
        self, level: int, pairs: Pairs, boxes: list[tuple[Floats, Floats]], budget: Budget, known: bool
    ) -> Iterator[Pairs]:
        """Pairs of overlapping leaves below overlapping pairs of nodes.

        If ``known``, also below the pairs without a common vertex that were listed when the tree was built.
        """
        while level < len(self._apart):
            count = len(self._moves[level + 1])
            pairs = self._wanted(_children(pairs, count), level + 1)
            if known:
                pairs = _both(pairs, self._apart[level])
            level += 1
            budget.spend(len(pairs[0]))
            pairs = _meeting(pairs, *boxes[level])
            if len(pairs[0]) > _CHUNK:
                for start in range(0, len(pairs[0]), _CHUNK):
                    part = slice(start, start + _CHUNK)
                    yield from self._below(level, (pairs[0][part], pairs[1][part]), boxes, budget, False)
                pairs = pairs[0][:0], pairs[1][:0]
        yield pairs


def _concerned(pairs: Pairs, moves: Bools) -> Pairs:
    concerned = np.flatnonzero(moves.take(pairs[0]) | moves.take(pairs[1]))
    return pairs[0].take(concerned), pairs[1].take(concerned)


def _meeting(pairs: Pairs, low: Floats, high: Floats) -> Pairs:
    first, second = pairs
    for lowest, highest in zip(low, high, strict=True):
        met = lowest.take(first) <= highest.take(second)
        met &= lowest.take(second) <= highest.take(first)
        near = np.flatnonzero(met)
        first, second = first.take(near), second.take(near)
    return first, second


def _both(pairs: Pairs, more: Pairs) -> Pairs:
    return np.concatenate([pairs[0], more[0]]), np.concatenate([pairs[1], more[1]])


def _joined(values: Values, join: np.ufunc, neutral: float) -> Values:
    """Values (..., count) of a level, joined in twos to those of the level above."""
    count = values.shape[-1]
    if count % 2:
        values = np.concatenate([values, np.full((*values.shape[:-1], 1), neutral, values.dtype)], axis=-1)
    joined: Values = join(values[..., 0::2], values[..., 1::2])
    return joined


def _common(groups: Ints) -> Ints:
    """(k,) groups of the nodes of the level above: the common group of both children, or -1."""
    last = np.append(groups, groups[-1:])  # the last node may have one child only
    first, second = groups[0::2], last[1::2][: len(groups[0::2])]
    return np.where(first == second, first, -1)


def _hubs(faces: Ints) -> Ints | None:
    """(m,) groups of triangles around the same very busy vertex, -1 for other triangles; None without such vertices."""
    around_each = np.bincount(faces.ravel())
    if around_each.max() <= _MOST_AROUND_A_VERTEX:
        return None
    count = around_each[faces]
    busiest = np.argmax(count, axis=1)[:, None]
    around = np.take_along_axis(count, busiest, axis=1).ravel() > _MOST_AROUND_A_VERTEX
    hubs = np.take_along_axis(faces, busiest, axis=1).ravel()[around]
    groups = np.full(len(faces), -1)
    groups[around] = np.searchsorted(distinct(hubs), hubs)
    return groups


def _children(pairs: Pairs, count: int) -> Pairs:
    """Pairs of children, smaller first, of pairs of nodes, which may be equal; the level has ``count`` children."""
    first, second = pairs
    itself = first == second
    one, other = 2 * first, 2 * second
    firsts = np.concatenate([one, one, one + 1, (one + 1)[~itself]])
    seconds = np.concatenate([other, other + 1, other + 1, other[~itself]])
    exist = seconds < count
    return firsts[exist], seconds[exist]


def _unique(first: Ints, second: Ints, count: int) -> Pairs:
    codes = distinct(first * count + second)
    return codes // count, codes % count


def _without(pairs: Pairs, others: Pairs, count: int) -> Pairs:
    kept = ~among(pairs[0] * count + pairs[1], others[0] * count + others[1])
    return pairs[0][kept], pairs[1][kept]


def _around_vertices(faces: Ints) -> Pairs:
    """Pairs of triangles with a common vertex, smaller first, and each triangle with itself."""
    corners = faces.ravel()
    order = np.argsort(corners, kind="stable")
    triangles = order // 3
    sizes = np.bincount(corners)
    sizes = sizes[sizes > 0]
    starts = np.cumsum(sizes) - sizes
    members = np.arange(len(faces))
    firsts, seconds = [members], [members]
    for size in np.unique(sizes):
        if 1 < size <= _MOST_AROUND_A_VERTEX:
            around = np.sort(triangles[starts[sizes == size][:, None] + np.arange(size)], axis=1)
            one, other = np.triu_indices(size, 1)
            firsts.append(around[:, one].ravel())
            seconds.append(around[:, other].ravel())
    return _unique(np.concatenate(firsts), np.concatenate(seconds), len(faces))


def halving_order(places: Floats) -> Ints:
    """(m,) order of items for the leaves of a tree whose nodes are halved across their longest extent.

    ``places`` (d, m) are coordinates of any dimension d.
    """
    count = places.shape[1]
    order = np.arange(count)
    size = 1 << max(0, count - 1).bit_length()
    while size > 1:
        starts = np.arange(0, count, size)
        extents = np.maximum.reduceat(places, starts, axis=1) - np.minimum.reduceat(places, starts, axis=1)
        node = np.arange(count) // size
        along = places[np.argmax(extents, axis=0)[node], np.arange(count)]
        # One combined key, the node plus the place in it, sorts faster than two keys.
        lowest = along.min()
        sorting = np.argsort(node + (along - lowest) / (2.0 * (along.max() - lowest) or 1.0))
        order, places = order[sorting], places[:, sorting]
        size //= 2
    return order
