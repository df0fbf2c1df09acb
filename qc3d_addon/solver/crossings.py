# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of triangles of one surface that cross each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .surface import cross_product
from .tetmesh import Bools, Floats, Ints

# Triangles are searched for by size: those of one level are up to so many times smaller than those of the last.
_LEVEL_RATIO = 3.0
# Cells of all smaller triangles are this fine: their numbers along three axes still fit into one integer.
_FINEST_LEVEL = 12
_CHUNK = 2_000_000
# Triangles that go through each other by less than this part of the surface's size touch.
_TOUCHING = 1e-10


def crossing_pairs(points: Floats, faces: Ints, moving: Bools | None = None) -> Ints:
    """Pairs of triangles that share no vertex and cross; touching does not count.

    Parameters
    ----------
    points : (n, 3)
    faces : (m, 3) int64
    moving : (m,) bool, optional
        Only pairs are looked for of which at least one triangle is among these.

    Returns
    -------
    (k, 2) int64, smaller index first, sorted.
    """
    if len(faces) < 2 or (moving is not None and not moving.any()):
        return np.empty((0, 2), dtype=np.int64)
    corners = np.ascontiguousarray(points.T)[:, faces.T]
    low, high = corners.min(axis=1), corners.max(axis=1)
    depth = _TOUCHING * float((high.max(axis=1) - low.min(axis=1)).max())
    members = np.arange(len(faces))
    if moving is not None:
        # What is not in the box of all that moves cannot be crossed by it.
        lowest, highest = low[:, moving].min(axis=1), high[:, moving].max(axis=1)
        members = np.flatnonzero(((low <= highest[:, None]) & (high >= lowest[:, None])).all(axis=0))
        corners, low, high, moving = corners[:, :, members], low[:, members], high[:, members], moving[members]
    vertices = faces[members]
    triangles = _Triangles.of(corners)
    codes = [np.empty(0, dtype=np.int64)]
    for first, second in _candidates(low.T, high.T, moving):
        for axis in range(3):
            met = (low[axis, first] <= high[axis, second]) & (low[axis, second] <= high[axis, first])
            first, second = first[met], second[met]
        apart = ~_share_a_vertex(vertices[first], vertices[second])
        first, second = first[apart], second[apart]
        crossing = _cross(triangles, first, second, depth)
        codes.append(members[first[crossing]] * len(faces) + members[second[crossing]])
    unique = np.unique(np.concatenate(codes))
    return np.stack([unique // len(faces), unique % len(faces)], axis=1)


def _candidates(low: Floats, high: Floats, moving: Bools | None) -> Iterator[tuple[Ints, Ints]]:
    """Pairs of boxes that share a cell of a grid, the smaller index first, in chunks.

    There is a grid for each level of size. Its cells are as large as its boxes, which meet each other and all smaller
    ones there: a few huge triangles among many tiny ones cost no more than their number.
    """
    sizes, origin = (high - low).max(axis=1), low.min(axis=0)
    extent = float((high - origin).max())
    if extent == 0.0:
        return
    parts = np.maximum(sizes / extent, _LEVEL_RATIO**-_FINEST_LEVEL)
    levels = np.floor(-np.log(parts) / np.log(_LEVEL_RATIO)).astype(np.int64)
    for level in np.unique(levels):
        members = np.flatnonzero(levels >= level)
        cell = extent / _LEVEL_RATIO**level
        owner, code = _covered_cells(low[members] - origin, high[members] - origin, cell)
        smaller = levels[members[owner]] > level
        order = np.lexsort((smaller, code))
        owner, code, smaller = members[owner[order]], code[order], smaller[order]
        if moving is not None:
            starts = np.flatnonzero(np.diff(code, prepend=-1))
            moved_in = np.logical_or.reduceat(moving[owner], starts)
            kept = np.repeat(moved_in, np.diff(starts, append=len(code)))
            owner, code, smaller = owner[kept], code[kept], smaller[kept]
            if not len(code):
                continue
        # Every entry of the level meets the later entries of its cell, the smaller ones after those of the level.
        ends = np.searchsorted(code, code, side="right")
        partners = np.where(smaller, 0, ends - np.arange(len(code)) - 1)
        totals = np.cumsum(partners)
        begin = 0
        while begin < len(code) and totals[-1] > totals[begin] - partners[begin]:
            done = totals[begin] - partners[begin]
            end = max(int(np.searchsorted(totals, done + _CHUNK, side="right")), begin + 1)
            repeats = partners[begin:end]
            left = np.repeat(np.arange(begin, end), repeats)
            right = left + 1 + np.arange(len(left)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
            first, second = owner[left], owner[right]
            if moving is not None:
                concerned = moving[first] | moving[second]
                first, second = first[concerned], second[concerned]
            yield np.minimum(first, second), np.maximum(first, second)
            begin = end


def _covered_cells(low: Floats, high: Floats, cell: float) -> tuple[Ints, Ints]:
    """The cells that boxes, measured from the grid's corner, lie in: numbers of the boxes, and of their cells."""
    first, last = (np.floor(bound / cell).astype(np.int64) for bound in (low, high))
    spans = last - first + 1
    counts = spans.prod(axis=1)
    owner = np.repeat(np.arange(len(low)), counts)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    span, place = spans[owner], first[owner]
    place[:, 0] += within // (span[:, 1] * span[:, 2])
    place[:, 1] += within // span[:, 2] % span[:, 1]
    place[:, 2] += within % span[:, 2]
    size = last.max(axis=0) + 1
    return owner, (place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2]


def _share_a_vertex(first: Ints, second: Ints) -> Bools:
    """(k,) whether triangles (k, 3) have a corner in common."""
    shared = np.zeros(len(first), dtype=bool)
    for corner in first.T:
        for other in second.T:
            shared |= corner == other
    return shared


@dataclass(frozen=True, eq=False)
class _Triangles:
    """Corners (3, 3, m), by coordinate and corner, normals (3, m), and lengths of both for the rounding of heights."""

    corners: Floats
    normals: Floats
    reaches: Floats
    sizes: Floats

    @classmethod
    def of(cls, corners: Floats) -> _Triangles:
        along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        normals = cross_product(along, across)
        lengths = [np.sqrt((vectors**2).sum(axis=0)) for vectors in (along, across, normals)]
        return cls(corners, normals, lengths[0] + lengths[1], lengths[2])

    def heights(self, members: Ints, others: Ints, depth: float) -> Floats:
        """(3, k) of the corners of ``others`` (k,) over the planes of ``members``; zero where that is no depth."""
        normals = self.normals[:, members]
        heights = np.empty((3, len(members)))
        for corner in range(3):
            offsets = self.corners[:, corner, others] - self.corners[:, 0, members]
            height = (offsets * normals).sum(axis=0)
            # What moving every corner by the depth can change: in one plane only rounding would decide.
            distance = np.sqrt((offsets**2).sum(axis=0))
            change = self.sizes[members] + distance * self.reaches[members]
            heights[corner] = np.where(np.abs(height) <= depth * change, 0.0, height)
        return heights


def _cross(triangles: _Triangles, first: Ints, second: Ints, depth: float) -> Bools:
    """Whether triangles cross deeper than ``depth``: an edge of one goes through the inside of the other."""
    result = np.zeros(len(first), dtype=bool)
    heights = triangles.heights(first, second, depth)
    # A triangle on one side of the other's plane is apart from it.
    near = np.flatnonzero(~((heights > 0.0).all(axis=0) | (heights < 0.0).all(axis=0)))
    first, second = first[near], second[near]
    crossing = _pierced(triangles, first, second, heights[:, near])
    crossing |= _pierced(triangles, second, first, triangles.heights(second, first, depth))
    result[near] = crossing
    return result


def _pierced(triangles: _Triangles, members: Ints, others: Ints, heights: Floats) -> Bools:
    """Whether an edge of ``others`` (k,), whose corners have ``heights`` (3, k), goes through ``members``."""
    result = np.zeros(len(members), dtype=bool)
    for start in range(3):
        end = (start + 1) % 3
        near = np.flatnonzero((heights[start] * heights[end] < 0.0) & ~result)
        tail, head = triangles.corners[:, start, others[near]], triangles.corners[:, end, others[near]]
        triangle = triangles.corners[:, :, members[near]]
        turns = [_orientation(tail, head, triangle[:, k], triangle[:, (k + 1) % 3]) for k in range(3)]
        result[near] = np.logical_and.reduce([turn > 0.0 for turn in turns]) | np.logical_and.reduce(
            [turn < 0.0 for turn in turns]
        )
    return result


def _orientation(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """(k,) six times the signed volumes of the tetrahedra with corners a, b, c, d, each (3, k)."""
    return np.asarray(((d - a) * cross_product(b - a, c - a)).sum(axis=0))
