# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of triangles of a surface that cross each other."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..triangles.geometry import cross_product
from .box_tree import Budget, TriangleTree

TOUCHING = 1e-10  # triangles that intersect less deeply than this, relative to the surface's size, only touch
_WORK_OF_A_TEST = 20  # the cost of testing two triangles, in comparisons of two boxes
_ODD = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: multiplicative hashing (Knuth 1973, section 6.4)


class CrossingSearch:
    """Finds the pairs of triangles that cross, in any shape of a surface.

    Of triangles that are listed several times, in whatever order of their corners, only the first counts.

    Parameters
    ----------
    faces : (m, 3) int64
        Triangles.
    shapes : sequence of (n, 3)
        Typical shapes, such as the two keys; the search is fast for shapes like these.
    moving : (m,) bool, optional
        Only pairs with at least one of these triangles are searched; all by default.
    sides : (m,) bool, optional
        Which of two surfaces each triangle belongs to; then only pairs of a triangle of each are searched.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [0.6, 0.5, 1]])
    >>> CrossingSearch(np.array([[0, 1, 2], [3, 4, 5]]), [points]).pairs(points)
    array([[0, 1]])
    """

    def __init__(
        self, faces: Ints, shapes: Sequence[Floats], moving: Bools | None = None, sides: Bools | None = None
    ) -> None:
        self._given, self._count = faces, len(faces)
        moving = np.ones(self._count, dtype=bool) if moving is None else moving
        self._once = once = _listed_once(faces)
        if once is not None:
            faces, moving, sides = faces[once], moving[once], None if sides is None else sides[once]
        groups = None if sides is None else sides.astype(np.int64)
        self._tree = TriangleTree(faces, shapes, moving, groups) if len(faces) > 1 and moving.any() else None
        if self._tree is not None:
            order = self._tree.order
            self._rows = order if once is None else once[order]
            self._faces = faces[order]
            self._corners = np.ascontiguousarray(self._faces.T)

    def is_of(self, faces: Ints) -> bool:
        """Whether it searches these triangles (m, 3)."""
        return np.array_equal(self._given, faces)

    def among(self, moving: Bools) -> CrossingSearch:
        """The same search, made for all triangles, of pairs with at least one of the triangles ``moving`` (m,) only."""
        fewer = copy.copy(self)
        chosen = moving if self._once is None else moving[self._once]
        fewer._tree = None if self._tree is None or not chosen.any() else self._tree.among(chosen)
        return fewer

    def within(self, low: Floats, high: Floats) -> CrossingSearch:
        """The same search, faster, in shapes each of whose points lies between the corners (n, 3) of a box of its own.

        Triangles whose boxes never overlap need not be looked at in any of these shapes.
        """
        faster = copy.copy(self)
        if self._tree is not None:
            lowest = np.stack([low.T[:, corner] for corner in self._corners]).min(axis=0)
            highest = np.stack([high.T[:, corner] for corner in self._corners]).max(axis=0)
            faster._tree = self._tree.within(lowest, highest)
        return faster

    def pairs(self, points: Floats) -> Ints:
        """Pairs of triangles that share no vertex and cross in the shape ``points`` (n, 3); touching does not count.

        Returns
        -------
        (k, 2) int64
            Sorted pairs, smaller index first.

        Raises
        ------
        CrowdedError
            If so many triangles overlap that comparing them would take too long.
        """
        if self._tree is None:
            return np.empty((0, 2), dtype=np.int64)
        corners = np.stack([coordinate.take(self._corners) for coordinate in np.ascontiguousarray(points.T)])
        one, two, three = corners[:, 0], corners[:, 1], corners[:, 2]
        low, high = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
        depth = TOUCHING * float((high.max(axis=1) - low.min(axis=1)).max())
        # Triangles smaller than the depth cannot cross: for example those of a part that is squashed to a point.
        tiny = np.flatnonzero(high[0] - low[0] <= 0.5 * depth)
        if len(tiny):
            low[:, tiny[(high[:, tiny] - low[:, tiny] <= 0.5 * depth).all(axis=0)]] = np.inf
        budget = Budget(len(self._faces))
        codes = []
        for first, second in self._tree.meeting(low, high, budget):
            apart = ~_share_a_vertex(self._faces[first], self._faces[second])
            first, second = first[apart], second[apart]
            budget.spend(_WORK_OF_A_TEST * len(first))
            crossing = _cross(corners.take(first, axis=2), corners.take(second, axis=2), depth)
            found = np.sort(self._rows[np.stack([first[crossing], second[crossing]])], axis=0)
            codes.append(found[0] * self._count + found[1])
        ordered = np.sort(np.concatenate(codes))
        return np.stack([ordered // self._count, ordered % self._count], axis=1)


def crossing_pairs(points: Floats, faces: Ints, moving: Bools | None = None) -> Ints:
    """(k, 2) pairs of triangles that cross in a single shape ``points`` (n, 3); see ``CrossingSearch``."""
    return CrossingSearch(faces, [points], moving).pairs(points)


def _listed_once(faces: Ints) -> Ints | None:
    """(k,) indices of the triangles without repetitions, ascending; None if no triangle is repeated."""
    # Sums of hashed indices, independent of the order of the corners, quickly rule out repetitions.
    scrambled = np.arange(int(faces.max(initial=-1)) + 1, dtype=np.uint64) * _ODD
    scrambled = (scrambled ^ scrambled >> np.uint64(29)) * _ODD
    sums = np.sort(scrambled[faces[:, 0]] + scrambled[faces[:, 1]] + scrambled[faces[:, 2]])
    if (sums[1:] != sums[:-1]).all():
        return None
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return np.sort(first) if len(first) < len(faces) else None


def _share_a_vertex(first: Ints, second: Ints) -> Bools:
    """(k,) whether triangles (k, 3) have a common vertex."""
    shared = np.zeros(len(first), dtype=bool)
    for corner in first.T:
        for other in second.T:
            shared |= corner == other
    return shared


def _cross(first: Floats, second: Floats, depth: float) -> Bools:
    """(k,) whether triangles cross by more than ``depth``: an edge of one passes through the inside of the other.

    Triangles are component-major, (3, 3, k): coordinate, corner, triangle.
    """
    result = np.zeros(first.shape[2], dtype=bool)
    near = np.arange(first.shape[2])
    pair = (first, second)
    # Triangles do not cross if one lies on one side of the other's plane; few pairs are left for the second plane.
    for _ in range(2):
        pair = (pair[1], pair[0])
        heights = _heights(*pair, depth)
        met = np.flatnonzero(~((heights > 0.0).all(axis=0) | (heights < 0.0).all(axis=0)))
        near, pair = near[met], (pair[0][:, :, met], pair[1][:, :, met])
    first, second = pair
    result[near] = pierced(first, second, depth) | pierced(second, first, depth)
    return result


def _heights(triangles: Floats, others: Floats, depth: float) -> Floats:
    """(3, k) scaled heights of the corners of ``others`` over the planes of ``triangles``; 0 if less than ``depth``."""
    along, across = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normals = cross_product(along, across)
    size, *reaches = (np.sqrt((vectors**2).sum(axis=0)) for vectors in (normals, along, across))
    heights = np.empty((3, triangles.shape[2]))
    for corner in range(3):
        offsets = others[:, corner] - triangles[:, 0]
        height = (offsets * normals).sum(axis=0)
        # The most that the height changes if all corners move by the depth. Below it, rounding would decide.
        change = size + np.sqrt((offsets**2).sum(axis=0)) * (reaches[0] + reaches[1])
        heights[corner] = np.where(np.abs(height) <= depth * change, 0.0, height)
    return heights


def pierced(triangles: Floats, others: Floats, depth: float) -> Bools:
    """(k,) whether an edge of ``others`` passes through the inside of ``triangles``, all (3, 3, k).

    They are component-major: coordinate, corner, triangle. What is less deep than ``depth`` only touches.
    """
    heights = _heights(triangles, others, depth)
    result = np.zeros(len(heights[0]), dtype=bool)
    for start in range(3):
        end = (start + 1) % 3
        near = np.flatnonzero((heights[start] * heights[end] < 0.0) & ~result)
        tail, head, triangle = others[:, start, near], others[:, end, near], triangles[:, :, near]
        turns = [_orientation(tail, head, triangle[:, k], triangle[:, (k + 1) % 3]) for k in range(3)]
        result[near] = np.logical_and.reduce([turn > 0.0 for turn in turns]) | np.logical_and.reduce(
            [turn < 0.0 for turn in turns]
        )
    return result


def _orientation(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """(k,) six times the signed volume of tetrahedra with corners a, b, c, d, each (3, k)."""
    return np.asarray(((d - a) * cross_product(b - a, c - a)).sum(axis=0))
