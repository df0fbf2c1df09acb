# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Signed distances from a triangle mesh: how far outside or inside points are, and the nearest point of the surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.grouped_sums import sums_by_label
from ..triangles.geometry import areas, face_normals
from ..triangles.topology import sides, welded
from .box_tree import halving_order

# Every node of the tree of triangles has so many children.
_FAN = 4
# Points that are worked on at once, so that what belongs to them stays in the processor's cache.
_BLOCK = 1_000


class SurfaceDistance:
    """Exact distances from one triangle mesh.

    Parameters
    ----------
    points : (c, 3)
    faces : (f, 3)
        Triangles whose normals point out; an open surface is outside on the side of its normals.
    """

    def __init__(self, points: Floats, faces: Ints) -> None:
        # Where copies of a vertex meet, the triangles of all of them decide which side is outside.
        vertices, group = welded(points, points)
        points, faces = points[vertices], group[faces]
        faces = faces[areas(points, faces) > 0.0]
        corners = points[faces]
        centers = corners.mean(axis=1)
        # Large triangles get branches of their own: among small ones they would spoil the bounds.
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

    def nearest(self, queries: Floats) -> tuple[Floats, Floats, Floats]:
        """Where points (q, 3) are.

        Returns
        -------
        distance : (q,)
            Positive outside, negative inside. The side is that of the angle-weighted pseudonormal of the nearest face,
            edge or vertex, which is right on every closed surface (Baerentzen & Aanaes 2005, "Signed distance
            computation using the angle weighted pseudonormal").
        place : (q, 3)
            The nearest point of the surface.
        normal : (q, 3)
            The surface's unit normal there, interpolated between vertices.
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
        """The triangle (q,) nearest to each query (q, 3), and the barycentric weights (q, 3) of the nearest point.

        Down the tree, level by level, nodes that are surely farther than others are left out.
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
            kept = nearer <= farthest[query]
            query, node = query[kept], node[kept]
        corners = self._points[self._faces[node]]
        weights = _closest_weights(queries[query], corners)
        squares = ((np.einsum("kc,kci->ki", weights, corners) - queries[query]) ** 2).sum(axis=1)
        best = np.lexsort((node, squares, query))
        best = best[np.flatnonzero(np.diff(query[best], prepend=-1))]
        return node[best], weights[best]

    def _pseudonormals(self, triangles: Ints, weights: Floats) -> Floats:
        """(q, 3) normals of the face, edge or vertex that a point with these barycentric weights lies on."""
        normals: Floats = self._face_normals[triangles]
        is_zero = weights == 0.0
        for corner in range(3):
            # Across from the corner is the side from the next corner on.
            rows = np.flatnonzero(is_zero[:, corner])
            normals[rows] = self._edge_normals[self._edge_of_side[(corner + 1) % 3, triangles[rows]]]
        for corner in range(3):
            rows = np.flatnonzero(is_zero[:, corner - 1] & is_zero[:, corner - 2])
            normals[rows] = self._vertex_normals[self._faces[triangles[rows], corner]]
        return normals


class _Slabs(NamedTuple):
    """Flat cylinders around groups of neighbouring triangles: what is nearly flat is bounded closely, however it lies.

    Component-major, so that inner loops are contiguous: ``middles`` and ``axes`` are (3, k), ``radii`` and ``heights``
    (half of them) (k,), ``members`` (3, k) a point of the surface in each.
    """

    middles: Floats
    axes: Floats
    radii: Floats
    heights: Floats
    members: Floats

    @classmethod
    def around(cls, corners: Floats, normals: Floats, size: int) -> _Slabs:
        """Around every ``size`` triangles that follow each other, by their corners (3, 3, f), the coordinate first, and
        their normals (3, f)."""
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
        # A little more than needed, so that rounding leaves nothing out.
        slack = 1e-9 * (across + highest - lowest)
        members = corners[:, :, starts + np.diff(starts, append=count) // 2].mean(axis=1)
        middles = middles + 0.5 * (lowest + highest) * axes
        return cls(middles, axes, across + slack, 0.5 * (highest - lowest) + slack, members)

    def bounds(self, queries: Floats, node: Ints) -> tuple[Floats, Floats]:
        """(k,) squared distances that the nearest point in a node is not below, and not above, for queries (3, k)."""
        x, y, z = queries - self.middles[:, node]
        u, v, w = self.axes[:, node]
        along = x * u + y * v + z * w
        across = np.sqrt(np.maximum(x * x + y * y + z * z - along * along, 0.0))
        beyond = np.maximum(np.abs(along) - self.heights[node], 0.0)
        beside = np.maximum(across - self.radii[node], 0.0)
        x, y, z = queries - self.members[:, node]
        return beyond * beyond + beside * beside, x * x + y * y + z * z


def _extremes(values: Floats, starts: Ints) -> tuple[Floats, Floats]:
    """(..., k) least and largest of three rows of values (3, ..., f) in each group of columns."""
    first, second, third = values
    least, most = np.minimum(np.minimum(first, second), third), np.maximum(np.maximum(first, second), third)
    return np.minimum.reduceat(least, starts, axis=-1), np.maximum.reduceat(most, starts, axis=-1)


def _vertex_normals(points: Floats, faces: Ints, normals: Floats) -> Floats:
    """(c, 3) unit normals of the vertices, each triangle's unit normal (f, 3) weighted by its angle there."""
    corners = points[faces]
    total = np.zeros_like(points)
    for corner in range(3):
        along, across = corners[:, (corner + 1) % 3] - corners[:, corner], corners[:, corner - 1] - corners[:, corner]
        angles = np.arctan2(np.linalg.norm(np.cross(along, across), axis=1), np.einsum("fi,fi->f", along, across))
        total += sums_by_label(faces[:, corner], angles[:, None] * normals, len(points))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300))


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
