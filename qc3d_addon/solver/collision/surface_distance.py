# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Signed distances from a triangle mesh: how far outside or inside points are, and the nearest point of the surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from ..numerics.grouped_sums import sums_by_label
from ..triangles.geometry import face_normals

# Triangles are found by the nearest of their samples: so many candidates for each point.
_CANDIDATES = 12
# Samples of a triangle are no farther apart than so many median edges of the mesh.
_SPACING = 1.5
_MOST_SAMPLES = 400_000


class SurfaceDistance:
    """Distances from one triangle mesh.

    Parameters
    ----------
    points : (c, 3)
    faces : (f, 3)
        Triangles whose normals point out; an open surface is outside on the side of its normals.
    """

    def __init__(self, points: Floats, faces: Ints) -> None:
        normals = face_normals(points, faces)
        faces = faces[np.linalg.norm(normals, axis=1) > 0.0]
        self._points, self._faces = points, faces
        self._normals = _vertex_normals(points, faces)
        samples, self._owners = _samples(points, faces)
        self._tree = cKDTree(samples)

    def nearest(self, queries: Floats) -> tuple[Floats, Floats, Floats]:
        """Where points (q, 3) are.

        Returns
        -------
        distance : (q,)
            Positive outside, negative inside.
        place : (q, 3)
            The nearest point of the surface.
        normal : (q, 3)
            The surface's unit normal there, angle-weighted and interpolated between vertices (after Baerentzen & Aanaes
            2005, "Signed distance computation using the angle weighted pseudonormal").
        """
        count = min(_CANDIDATES, len(self._owners))
        near = self._tree.query(queries, k=count)[1].reshape(len(queries), count)
        candidates = self._owners[near]
        corners = self._points[self._faces[candidates]]
        weights = _closest_weights(queries[:, None], corners)
        places = np.einsum("qkc,qkci->qki", weights, corners)
        squares = ((places - queries[:, None]) ** 2).sum(axis=2)
        rows, best = np.arange(len(queries)), squares.argmin(axis=1)
        place = places[rows, best]
        triangle, weight = candidates[rows, best], weights[rows, best]
        normal = np.einsum("qc,qci->qi", weight, self._normals[self._faces[triangle]])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        side = np.where(np.einsum("qi,qi->q", normal, queries - place) < 0.0, -1.0, 1.0)
        return side * np.sqrt(squares[rows, best]), place, normal


def _vertex_normals(points: Floats, faces: Ints) -> Floats:
    """(c, 3) unit normals of the vertices, each triangle weighted by its angle there."""
    corners = points[faces]
    unit = face_normals(points, faces)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    total = np.zeros_like(points)
    for corner in range(3):
        along, across = corners[:, (corner + 1) % 3] - corners[:, corner], corners[:, corner - 1] - corners[:, corner]
        angles = np.arctan2(np.linalg.norm(np.cross(along, across), axis=1), np.einsum("fi,fi->f", along, across))
        total += sums_by_label(faces[:, corner], angles[:, None] * unit, len(points))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300))


def _samples(points: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Points on the triangles, and whose they are: centroids, and a grid on triangles much larger than most."""
    corners = points[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    spacing = _SPACING * float(np.median(longest))
    parts = np.ceil(longest / spacing).astype(np.int64)
    while int((parts * (parts + 1) // 2).sum()) > max(_MOST_SAMPLES, len(faces)):
        parts = np.maximum(parts // 2, 1)
    samples, owners = [], []
    for part in np.unique(parts):
        rows = np.flatnonzero(parts == part)
        first, second = np.divmod(np.arange(part * part), part)
        kept = first + second < part
        weights = np.stack([first[kept] + 1.0 / 3.0, second[kept] + 1.0 / 3.0], axis=1) / part
        weights = np.column_stack([weights, 1.0 - weights.sum(axis=1)])
        samples.append(np.einsum("sc,fci->fsi", weights, corners[rows]).reshape(-1, 3))
        owners.append(np.repeat(rows, len(weights)))
    return np.concatenate(samples), np.concatenate(owners)


def _closest_weights(queries: Floats, corners: Floats) -> Floats:
    """(..., 3) barycentric weights of the point of each triangle (..., 3, 3) nearest to a query (..., 3)."""
    a, b, c = (corners[..., corner, :] for corner in range(3))
    along, across, offset = b - a, c - a, queries - a
    d00, d01, d11 = _dot(along, along), _dot(along, across), _dot(across, across)
    d20, d21 = _dot(offset, along), _dot(offset, across)
    determinant = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / determinant, (d00 * d21 - d01 * d20) / determinant
    weights = np.stack([1.0 - v - w, v, w], axis=-1)
    outside = (weights < 0.0).any(axis=-1)
    # Beyond an edge: the nearest point of the three edges.
    edges = []
    for first, second in ((0, 1), (1, 2), (2, 0)):
        start, end = corners[..., first, :], corners[..., second, :]
        span = end - start
        part = np.clip(_dot(queries - start, span) / np.maximum(_dot(span, span), 1e-300), 0.0, 1.0)
        edge = np.zeros_like(weights)
        edge[..., first], edge[..., second] = 1.0 - part, part
        missing = queries - start - part[..., None] * span
        edges.append((edge, _dot(missing, missing)))
    best = np.argmin(np.stack([square for _, square in edges]), axis=0)
    nearest = np.choose(best[..., None], [edge for edge, _ in edges])
    return np.where(outside[..., None], nearest, weights)


def _dot(first: Floats, second: Floats) -> Floats:
    return np.asarray(np.einsum("...i,...i->...", first, second))
