# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of triangles of one surface that cross each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..triangles.geometry import cross_product
from .box_tree import Budget, TriangleTree

# Triangles that go through each other by less than this part of the surface's size touch.
_TOUCHING = 1e-10
_WORK_OF_A_TEST = 20  # of two triangles, as comparisons of two boxes
_ODD = np.uint64(0x9E3779B97F4A7C15)  # multiplying by it scrambles: 2^64 over the golden ratio (Knuth 1973, 6.4)


class CrossingSearch:
    """Finds the pairs of triangles that cross, in any shape of one surface.

    A triangle that is listed more than once, in whatever order of its corners, counts as the first of these.

    Parameters
    ----------
    faces : (m, 3) int64
    shapes : sequence of (n, 3)
        Shapes that the surface takes, such as its two keys: the search is quick near these.
    moving : (m,) bool, optional
        Only pairs are looked for of which at least one triangle is among these.
    sides : (m,) bool, optional
        Which of two surfaces each triangle belongs to: only pairs across both are looked for.
    """

    def __init__(
        self, faces: Ints, shapes: Sequence[Floats], moving: Bools | None = None, sides: Bools | None = None
    ) -> None:
        self._count = len(faces)
        moving = np.ones(self._count, dtype=bool) if moving is None else moving
        once = _listed_once(faces)
        if once is not None:
            faces, moving, sides = faces[once], moving[once], None if sides is None else sides[once]
        groups = None if sides is None else sides.astype(np.int64)
        self._tree = TriangleTree(faces, shapes, moving, groups) if len(faces) > 1 and moving.any() else None
        if self._tree is not None:
            order = self._tree.order
            self._rows = order if once is None else once[order]
            self._faces = faces[order]
            self._corners = np.ascontiguousarray(self._faces.T)

    def pairs(self, points: Floats) -> Ints:
        """Pairs of triangles that share no vertex and cross in the shape ``points`` (n, 3); touching does not count.

        Returns
        -------
        (k, 2) int64, smaller index first, sorted.

        Raises
        ------
        CrowdedError
            If so many triangles lie over each other that comparing them would take too long.
        """
        if self._tree is None:
            return np.empty((0, 2), dtype=np.int64)
        corners = np.stack([coordinate[self._corners] for coordinate in np.ascontiguousarray(points.T)])
        one, two, three = corners[:, 0], corners[:, 1], corners[:, 2]
        low, high = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
        depth = _TOUCHING * float((high.max(axis=1) - low.min(axis=1)).max())
        # What is smaller than the depth crosses nothing: the thousands of triangles of a part that is a point, say.
        tiny = ((high - low) <= 0.5 * depth).all(axis=0)
        if tiny.any():
            low[:, tiny] = np.inf
        budget = Budget(len(self._faces))
        codes = []
        for first, second in self._tree.meeting(low, high, budget):
            apart = ~_share_a_vertex(self._faces[first], self._faces[second])
            first, second = first[apart], second[apart]
            budget.spend(_WORK_OF_A_TEST * len(first))
            crossing = _cross(corners[:, :, first], corners[:, :, second], depth)
            found = np.sort(self._rows[np.stack([first[crossing], second[crossing]])], axis=0)
            codes.append(found[0] * self._count + found[1])
        ordered = np.sort(np.concatenate(codes))
        return np.stack([ordered // self._count, ordered % self._count], axis=1)


def crossing_pairs(points: Floats, faces: Ints, moving: Bools | None = None) -> Ints:
    """Pairs of triangles (k, 2) that cross in one shape (n, 3); see ``CrossingSearch``."""
    return CrossingSearch(faces, [points], moving).pairs(points)


def _listed_once(faces: Ints) -> Ints | None:
    """(k,) the triangles without repetitions, ascending; None where nothing is repeated."""
    # Sums of scrambled numbers tell in no time, whatever the order of the corners, that no triangle is repeated.
    scrambled = np.arange(int(faces.max(initial=-1)) + 1, dtype=np.uint64) * _ODD
    scrambled = (scrambled ^ scrambled >> np.uint64(29)) * _ODD
    sums = np.sort(scrambled[faces[:, 0]] + scrambled[faces[:, 1]] + scrambled[faces[:, 2]])
    if (sums[1:] != sums[:-1]).all():
        return None
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return np.sort(first) if len(first) < len(faces) else None


def _share_a_vertex(first: Ints, second: Ints) -> Bools:
    """(k,) whether triangles (k, 3) have a corner in common."""
    shared = np.zeros(len(first), dtype=bool)
    for corner in first.T:
        for other in second.T:
            shared |= corner == other
    return shared


def _cross(first: Floats, second: Floats, depth: float) -> Bools:
    """(k,) whether triangles cross deeper than ``depth``: an edge of one goes through the inside of the other.

    Triangles are (3, 3, k), by coordinate and corner.
    """
    result = np.zeros(first.shape[2], dtype=bool)
    near = np.arange(first.shape[2])
    pair = (first, second)
    # A triangle on one side of the other's plane is apart from it; few are left for the second plane.
    for _ in range(2):
        pair = (pair[1], pair[0])
        heights = _heights(*pair, depth)
        met = np.flatnonzero(~((heights > 0.0).all(axis=0) | (heights < 0.0).all(axis=0)))
        near, pair = near[met], (pair[0][:, :, met], pair[1][:, :, met])
    first, second = pair
    result[near] = _pierced(first, second, depth) | _pierced(second, first, depth)
    return result


def _heights(triangles: Floats, others: Floats, depth: float) -> Floats:
    """(3, k) of the corners of ``others`` over the planes of ``triangles``; zero where that is no depth."""
    along, across = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normals = cross_product(along, across)
    size, *reaches = (np.sqrt((vectors**2).sum(axis=0)) for vectors in (normals, along, across))
    heights = np.empty((3, triangles.shape[2]))
    for corner in range(3):
        offsets = others[:, corner] - triangles[:, 0]
        height = (offsets * normals).sum(axis=0)
        # What moving every corner by the depth can change: in one plane only rounding would decide.
        change = size + np.sqrt((offsets**2).sum(axis=0)) * (reaches[0] + reaches[1])
        heights[corner] = np.where(np.abs(height) <= depth * change, 0.0, height)
    return heights


def _pierced(triangles: Floats, others: Floats, depth: float) -> Bools:
    """(k,) whether an edge of ``others`` goes through the inside of ``triangles``, all (3, 3, k)."""
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
    """(k,) six times the signed volumes of the tetrahedra with corners a, b, c, d, each (3, k)."""
    return np.asarray(((d - a) * cross_product(b - a, c - a)).sum(axis=0))
