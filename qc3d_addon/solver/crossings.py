# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of triangles of one surface that cross each other."""

from __future__ import annotations

import numpy as np

from .tetmesh import Bools, Floats, Ints

# Cells of the search grid are widened until a triangle lies in so many of them on average.
_MOST_CELLS_EACH = 8
_CHUNK = 2_000_000


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
    codes = [np.empty(0, dtype=np.int64)]
    for first, second in _candidates(low, high):
        kept = _near_and_apart(low, high, faces, first, second)
        first, second = first[kept], second[kept]
        crossing = _cross(corners[first], corners[second])
        codes.append(first[crossing] * len(faces) + second[crossing])
    unique = np.unique(np.concatenate(codes))
    return np.stack([unique // len(faces), unique % len(faces)], axis=1)


def _candidates(low: Floats, high: Floats) -> list[tuple[Ints, Ints]]:
    """Pairs that share a cell of a uniform grid, each with the smaller index first, in chunks."""
    cell = max(float((high - low).max(axis=1).mean()), 1e-300)
    origin = low.min(axis=0)
    while True:
        first_cell, last_cell = (np.floor((bound - origin) / cell).astype(np.int64) for bound in (low, high))
        spans = last_cell - first_cell + 1
        counts = spans.prod(axis=1)
        if counts.sum() <= _MOST_CELLS_EACH * len(low):
            break
        cell *= 1.5
    owner = np.repeat(np.arange(len(low)), counts)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    span = spans[owner]
    place = first_cell[owner]
    place[:, 0] += within // (span[:, 1] * span[:, 2])
    place[:, 1] += within // span[:, 2] % span[:, 1]
    place[:, 2] += within % span[:, 2]
    size = last_cell.max(axis=0) + 1
    code = (place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2]
    order = np.lexsort((owner, code))
    owner, code = owner[order], code[order]
    # Every entry of a cell meets the later entries of that cell.
    ends = np.searchsorted(code, code, side="right")
    later = ends - np.arange(len(code)) - 1
    borders = np.searchsorted(np.cumsum(later), np.arange(_CHUNK, int(later.sum()) + _CHUNK, _CHUNK))
    chunks = []
    begin = 0
    for end in np.minimum(borders + 1, len(code)):
        entries = np.arange(begin, end)
        repeats = later[entries]
        left = np.repeat(entries, repeats)
        offsets = np.arange(len(left)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
        chunks.append((owner[left], owner[left + 1 + offsets]))
        begin = end
    return chunks


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


def _cross(first: Floats, second: Floats) -> Bools:
    """Whether triangles (k, 3, 3) cross: an edge of one goes through the inside of the other."""
    result = np.zeros(len(first), dtype=bool)
    for triangle, other in ((first, second), (second, first)):
        sides = _orientation(triangle[:, None, 0], triangle[:, None, 1], triangle[:, None, 2], other)
        for start in range(3):
            end = (start + 1) % 3
            apart = sides[:, start] * sides[:, end] < 0.0
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
