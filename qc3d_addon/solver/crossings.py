# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of triangles of one surface that cross each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .tetmesh import Bools, Floats, Ints

# Triangles are searched for by size: those of one level are up to so many times smaller than those of the last.
_LEVEL_RATIO = 3.0
# Cells of all smaller triangles are this fine: their numbers along three axes still fit into one integer.
_FINEST_LEVEL = 12
_CHUNK = 2_000_000
# Triangles that go through each other by less than this part of the surface's size touch.
_TOUCHING = 1e-10


def crossing_pairs(points: Floats, faces: Ints) -> Ints:
    """Pairs of triangles that share no vertex and cross; touching does not count.

    Parameters
    ----------
    points : (n, 3)
    faces : (m, 3) int64

    Returns
    -------
    (k, 2) int64, smaller index first, sorted.
    """
    if len(faces) < 2:
        return np.empty((0, 2), dtype=np.int64)
    corners = points[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    depth = _TOUCHING * float((high.max(axis=0) - low.min(axis=0)).max())
    codes = [np.empty(0, dtype=np.int64)]
    for first, second in _candidates(low, high):
        kept = _near_and_apart(low, high, faces, first, second)
        first, second = first[kept], second[kept]
        crossing = _cross(corners[first], corners[second], depth)
        codes.append(first[crossing] * len(faces) + second[crossing])
    unique = np.unique(np.concatenate(codes))
    return np.stack([unique // len(faces), unique % len(faces)], axis=1)


def _candidates(low: Floats, high: Floats) -> Iterator[tuple[Ints, Ints]]:
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


def _near_and_apart(low: Floats, high: Floats, faces: Ints, first: Ints, second: Ints) -> Bools:
    """Whether bounding boxes overlap and no vertex is shared."""
    kept = np.ones(len(first), dtype=bool)
    for axis in range(3):
        kept &= (low[first, axis] <= high[second, axis]) & (low[second, axis] <= high[first, axis])
    near = np.flatnonzero(kept)
    corners, others = faces[first[near]], faces[second[near]]
    for corner in range(3):
        kept[near] &= (corners[:, corner, None] != others).all(axis=1)
    return kept


def _cross(first: Floats, second: Floats, depth: float) -> Bools:
    """Whether triangles (k, 3, 3) cross deeper than ``depth``: an edge of one goes through the inside of the other."""
    result = np.zeros(len(first), dtype=bool)
    for triangle, other in ((first, second), (second, first)):
        along, across = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
        normals, offsets = np.cross(along, across), other - triangle[:, None, 0]
        heights = np.einsum("kci,ki->kc", offsets, normals)
        # What moving every corner by the depth can change: in one plane only rounding would decide.
        reach = np.linalg.norm(along, axis=1) + np.linalg.norm(across, axis=1)
        change = np.linalg.norm(normals, axis=1)[:, None] + np.linalg.norm(offsets, axis=2) * reach[:, None]
        heights[np.abs(heights) <= depth * change] = 0.0
        for start in range(3):
            end = (start + 1) % 3
            apart = heights[:, start] * heights[:, end] < 0.0
            near = np.flatnonzero(apart & ~result)
            tail, head = other[near, start], other[near, end]
            turns = np.stack(
                [_orientation(tail, head, triangle[near, k], triangle[near, (k + 1) % 3]) for k in range(3)], axis=1
            )
            result[near] = (turns > 0.0).all(axis=1) | (turns < 0.0).all(axis=1)
    return result


def _orientation(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Six times the signed volume of the tetrahedra a, b, c, d."""
    return np.asarray(np.einsum("...i,...i->...", d - a, np.cross(b - a, c - a)))
