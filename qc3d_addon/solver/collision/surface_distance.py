# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact signed distances from a triangle mesh, and the nearest points on it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.grouped_sums import sums_by_label
from ..triangles.geometry import areas, face_normals
from ..triangles.topology import sides, welded
from .box_tree import halving_order

_FAN = 4  # children of each node of the tree: with fewer, numpy is called on too many levels
_SURELY = 1.0 - 1e-9  # factor below which a bound is smaller whatever its rounding
_BLOCK = 1_000  # queries processed at once: their temporary arrays stay in the processor's cache


class SurfaceDistance:
    """Exact signed distances from a triangle mesh.

    Parameters
    ----------
    points : (c, 3)
        Vertices.
    faces : (f, 3) int64
        Triangles with normals pointing out. The outside of an open surface is the side of its normals.

    Examples
    --------
    >>> floor = np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]])
    >>> distance, place, normal = SurfaceDistance(floor, np.array([[0, 1, 2]])).nearest(np.array([[0, 0, -2.0]]))
    >>> distance
    array([-2.])
    """

    def __init__(self, points: Floats, faces: Ints) -> None:
        # At coincident vertices, the triangles of all of them decide which side is outside.
        vertices, group = welded(points, points)
        points, faces = points[vertices], group[faces]
        faces = faces[areas(points, faces) > 0.0]
        corners = points[faces]
        centers = corners.mean(axis=1)
        # The size as an extra coordinate: large triangles get branches of their own, because they would loosen the
        # bounds of small ones.
        radii = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
        faces = faces[halving_order(np.column_stack([centers, radii]).T)]
        normals = face_normals(points, faces)
        self._points, self._faces = points, faces
        self._face_normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        self._vertex_normals = _vertex_normals(points, faces, self._face_normals)
        edges = sides(faces)
        self._edge_of_side = np.unique(edges[:, 0] * len(points) + edges[:, 1], return_inverse=True)[1].reshape(3, -1)
        self._edge_normals = sums_by_label(self._edge_of_side.ravel(), np.tile(self._face_normals, (3, 1)))
        corners, normals = np.ascontiguousarray(points[faces].transpose(2, 1, 0)), np.ascontiguousarray(normals.T)
        size, self._levels = 1, [_Slabs.around(corners, normals, 1)]
        while self._levels[0].middles.shape[1] > 1:
            size *= _FAN
            self._levels.insert(0, _Slabs.around(corners, normals, size))

    @np.errstate(over="ignore", invalid="ignore")  # of queries so far away that their squares are infinite
    def nearest(self, queries: Floats) -> tuple[Floats, Floats, Floats]:
        """Signed distances and nearest points of the surface for points (q, 3).

        Returns
        -------
        distance : (q,)
            Positive outside, negative inside. The sign is that of the angle-weighted pseudonormal of the nearest face,
            edge or vertex, which is correct for every closed surface (Baerentzen & Aanaes 2005, "Signed distance
            computation using the angle weighted pseudonormal").
        place : (q, 3)
            Nearest point on the surface.
        normal : (q, 3)
            Unit normal of the surface there, interpolated between vertices.
        """
        triangle, weight = np.empty(len(queries), dtype=np.int64), np.empty((len(queries), 3))
        for start in range(0, len(queries), _BLOCK):
            block = slice(start, start + _BLOCK)
            triangle[block], weight[block] = self._closest(queries[block])
        corners = self._faces[triangle]
        place = np.einsum("qc,qci->qi", weight, self._points[corners])
        normal = np.einsum("qc,qci->qi", weight, self._vertex_normals[corners])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        apart = queries - place
        side = np.einsum("qi,qi->q", self._pseudonormals(triangle, weight), apart)
        return np.where(side < 0.0, -1.0, 1.0) * np.linalg.norm(apart, axis=1), place, normal

    def _closest(self, queries: Floats) -> tuple[Ints, Floats]:
        """The nearest triangle (q,) to each query (q, 3), and the barycentric weights (q, 3) of the nearest point.

        Branch and bound, level by level, for all queries at once.
        """
        places = np.ascontiguousarray(queries.T)
        query, node = np.arange(len(queries)), np.zeros(len(queries), dtype=np.int64)
        farthest = np.full(len(queries), np.inf)
        for level in self._levels:
            if level is not self._levels[0]:
                query = np.repeat(query, _FAN)
                node = (_FAN * node[:, None] + np.arange(_FAN)).ravel()
                exist = node < level.middles.shape[1]
                query, node = query[exist], node[exist]
            nearer, farther = level.bounds(places[:, query], node)
            firsts = np.flatnonzero(np.diff(query, prepend=-1))
            farthest = np.minimum(farthest, np.minimum.reduceat(farther, firsts))
            # Of queries very far away, bounds are equal up to rounding, or not numbers: these rule out nothing.
            kept = ~(_SURELY * nearer > farthest[query])
            query, node = query[kept], node[kept]
        corners = self._points[self._faces[node]]
        weights = _closest_weights(queries[query], corners)
        squares = ((np.einsum("kc,kci->ki", weights, corners) - queries[query]) ** 2).sum(axis=1)
        best = np.lexsort((node, squares, query))
        best = best[np.flatnonzero(np.diff(query[best], prepend=-1))]
        return node[best], weights[best]

    def _pseudonormals(self, triangles: Ints, weights: Floats) -> Floats:
        """(q, 3) pseudonormals of the face, edge or vertex that a point with these barycentric weights lies on."""
        normals: Floats = self._face_normals[triangles]
        is_zero = weights == 0.0
        for corner in range(3):
            # The side opposite a corner starts at the next corner.
            rows = np.flatnonzero(is_zero[:, corner])
            normals[rows] = self._edge_normals[self._edge_of_side[(corner + 1) % 3, triangles[rows]]]
        for corner in range(3):
            rows = np.flatnonzero(is_zero[:, corner - 1] & is_zero[:, corner - 2])
            normals[rows] = self._vertex_normals[self._faces[triangles[rows], corner]]
        return normals


class _Slabs(NamedTuple):
    """Bounding cylinders of groups of neighboring triangles; they bound nearly flat groups tightly in any orientation.

    Component-major, so that inner loops are contiguous: centers ``middles`` (3, k), unit ``axes`` (3, k), ``radii``
    (k,), half ``heights`` (k,), and ``members`` (3, k), a point of the surface in each group.
    """

    middles: Floats
    axes: Floats
    radii: Floats
    heights: Floats
    members: Floats

    @classmethod
    def around(cls, corners: Floats, normals: Floats, size: int) -> _Slabs:
        """Around each run of ``size`` triangles with corners (3, 3, f), coordinate first, and normals (3, f)."""
        count = corners.shape[2]
        starts = np.arange(0, count, size)
        group = np.arange(count) // size
        axes = np.add.reduceat(normals, starts, axis=1)
        length = np.sqrt((axes**2).sum(axis=0))
        axes = np.where(length > 0.0, axes / np.maximum(length, 1e-300), np.array([[0.0], [0.0], [1.0]]))
        low, high = _extremes(corners.transpose(1, 0, 2), starts)
        middles = 0.5 * (low + high)
        offsets = corners - middles[:, None, group]
        (x, y, z), (u, v, w) = offsets, axes[:, group]
        along = x * u + y * v + z * w
        lowest, highest = _extremes(along, starts)
        across = np.sqrt(_extremes(np.maximum(x * x + y * y + z * z - along * along, 0.0), starts)[1])
        # Slightly enlarged against rounding.
        slack = 1e-9 * (across + highest - lowest)
        members = corners[:, :, starts + np.diff(starts, append=count) // 2].mean(axis=1)
        middles = middles + 0.5 * (lowest + highest) * axes
        return cls(middles, axes, across + slack, 0.5 * (highest - lowest) + slack, members)

    def bounds(self, queries: Floats, node: Ints) -> tuple[Floats, Floats]:
        """(k,) lower and upper bounds of squared distances from queries (3, k) to the surface in their nodes (k,)."""
        x, y, z = queries - self.middles[:, node]
        u, v, w = self.axes[:, node]
        along = x * u + y * v + z * w
        across = np.sqrt(np.maximum(x * x + y * y + z * z - along * along, 0.0))
        beyond = np.maximum(np.abs(along) - self.heights[node], 0.0)
        beside = np.maximum(across - self.radii[node], 0.0)
        x, y, z = queries - self.members[:, node]
        return beyond * beyond + beside * beside, x * x + y * y + z * z


def _extremes(values: Floats, starts: Ints) -> tuple[Floats, Floats]:
    """(..., k) minimum and maximum of values (3, ..., f), over the first axis and over each group of columns."""
    first, second, third = values
    least, most = np.minimum(np.minimum(first, second), third), np.maximum(np.maximum(first, second), third)
    return np.minimum.reduceat(least, starts, axis=-1), np.maximum.reduceat(most, starts, axis=-1)


def _vertex_normals(points: Floats, faces: Ints, normals: Floats) -> Floats:
    """(c, 3) unit vertex normals: the triangles' unit normals (f, 3) weighted by their angles at the vertex."""
    corners = points[faces]
    total = np.zeros_like(points)
    for corner in range(3):
        along, across = corners[:, (corner + 1) % 3] - corners[:, corner], corners[:, corner - 1] - corners[:, corner]
        angles = np.arctan2(np.linalg.norm(np.cross(along, across), axis=1), np.einsum("fi,fi->f", along, across))
        total += sums_by_label(faces[:, corner], angles[:, None] * normals, len(points))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300))


def _closest_weights(queries: Floats, corners: Floats) -> Floats:
    """(..., 3) barycentric weights of the point nearest to each query (..., 3) in its triangle (..., 3, 3)."""
    a, b, c = (corners[..., corner, :] for corner in range(3))
    along, across, offset = b - a, c - a, queries - a
    d00, d01, d11 = _dot(along, along), _dot(along, across), _dot(across, across)
    d20, d21 = _dot(offset, along), _dot(offset, across)
    determinant = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / determinant, (d00 * d21 - d01 * d20) / determinant
    weights = np.stack([1.0 - v - w, v, w], axis=-1)
    outside = (weights < 0.0).any(axis=-1)
    # If the foot of the perpendicular is outside, the nearest point is on one of the edges.
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
