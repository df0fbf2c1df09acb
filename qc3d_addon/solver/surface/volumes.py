# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Enclosed volumes of a surface with moving and still vertices, and their gradients."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Floats, Ints
from ..numerics.assembly import PerCoordinate
from ..numerics.grouped_sums import sums_by_label
from ..triangles.closed_volume import ClosedComponents, volumes_seen_from
from ..triangles.geometry import cross_product
from ..triangles.topology import distinct

_TRIANGLES_AT_ONCE = 15_000  # their arrays fit into the cache of one core


class MovingVolumes:
    """Volumes of the closed components that have moving vertices.

    Each volume is split into the part of the moving triangles, which is computed again and again, and the part of the
    still triangles, which is computed once.

    Parameters
    ----------
    closed : ClosedComponents
    covering : tuple of (t, 3) int64 and (t,)
        Triangles that cover the surface evenly, and what each counts, for directions that favor no diagonal of a quad.
    moving : (k,) int64
        The moving vertices.
    used : (l,) int64
        The vertices whose positions will be given: first the moving ones, then at least all that share a triangle with
        one of them.
    """

    def __init__(self, closed: ClosedComponents, covering: tuple[Ints, Floats], moving: Ints, used: Ints) -> None:
        count = len(closed.labels)
        moves = np.zeros(count, dtype=bool)
        moves[moving] = True
        touched = moves[closed.faces].any(axis=1)
        faces, self._resting = closed.faces[touched], closed.faces[~touched]
        self._labels = closed.labels
        self._label_of_vertex = closed.labels[moving]
        self._label_of_face = closed.labels[faces[:, 0]]
        number = np.full(count, -1, dtype=np.int64)
        number[used] = np.arange(len(used))
        self._corners: Ints = np.ascontiguousarray(number[faces].T)
        # The apex of a component's cones is one of its vertices, a still one if there is one, so that the part of the
        # still triangles is constant.
        corners = distinct(faces.ravel())
        corners = corners[np.lexsort((moves[corners], closed.labels[corners]))]
        labels, first = np.unique(closed.labels[corners], return_index=True)
        self._components = int(closed.labels.max(initial=-1)) + 1
        self._views = np.zeros(self._components, dtype=np.int64)
        self._views[labels] = corners[first]
        # The three corners of each triangle and the apex of its cone.
        self._looked_at = np.concatenate([self._corners, number[self._views[self._label_of_face]][None]])
        self._incidence = PerCoordinate(_incidence(self._corners, len(moving)))
        triangles, shares = covering
        touched = closed.among(triangles) & moves[triangles].any(axis=1)
        self._even_corners: Ints = np.ascontiguousarray(number[triangles[touched]].T)
        self._even_incidence = PerCoordinate(_incidence(self._even_corners, len(moving), shares[touched]))

    @property
    def empty(self) -> bool:
        """Whether no closed component has moving vertices."""
        return not self._corners.size

    def resting(self, positions: Floats) -> Floats:
        """(components,) volume under the still triangles, for positions (n, 3) of all vertices."""
        return volumes_seen_from(positions[self._views], positions, self._resting, self._labels)

    def with_slope(self, positions: Floats) -> tuple[Floats, Floats]:
        """Volumes under the moving triangles, and their gradients.

        Parameters
        ----------
        positions : (3, l)
            Positions of the used vertices.

        Returns
        -------
        volumes : (components,)
        slope : (3, k)
            Derivative of the volume of each moving vertex's component with respect to the vertex's coordinates.
        """
        normals, shares = np.empty(self._corners.shape), np.empty(self._corners.shape[1])
        for start in range(0, len(shares), _TRIANGLES_AT_ONCE):
            part = slice(start, start + _TRIANGLES_AT_ONCE)
            looked_at = self._looked_at[:, part]
            seen = np.empty((3, *looked_at.shape))
            for axis in range(3):
                np.take(positions[axis], looked_at, out=seen[axis], mode="clip")
            first, second, third, view = seen.transpose(1, 0, 2)
            normals[:, part] = cross_product(second - first, third - first)
            shares[part] = ((first - view) * normals[:, part]).sum(axis=0)
        volumes = sums_by_label(self._label_of_face, shares, self._components) / 6.0
        return volumes, self._incidence(normals) / 6.0

    def even_slope(self, positions: Floats) -> Floats:
        """(3, k) how volumes change with what moves, polygons taken as the mean of all ways to triangulate them."""
        normals = np.empty(self._even_corners.shape)
        for start in range(0, normals.shape[1], _TRIANGLES_AT_ONCE):
            part = slice(start, start + _TRIANGLES_AT_ONCE)
            first, second, third = (positions[:, corners] for corners in self._even_corners[:, part])
            normals[:, part] = cross_product(second - first, third - first)
        return np.asarray(self._even_incidence(normals) / 6.0)

    def changes(self, slope: Floats, moves: Floats) -> Floats:
        """(components,) first-order change of the volumes if the moving vertices are displaced by ``moves`` (3, k)."""
        return sums_by_label(self._label_of_vertex, (slope * moves).sum(axis=0), self._components)

    def stepped(self, moved: Floats, direction: Floats, slope: Floats, missing: Floats) -> Floats:
        """(3, k) positions moved along ``direction`` so that, to first order, volumes grow by ``missing``."""
        gain = self.changes(slope, direction)
        grows = gain > 0.0
        length = np.where(grows, missing / np.where(grows, gain, 1.0), 0.0)
        return np.asarray(moved + length[self._label_of_vertex] * direction)


def _incidence(corners: Ints, count: int, shares: Floats | None = None) -> csr_array:
    """(count, m) which of the first vertices are corners (3, m) of which triangles; what each counts, or 1."""
    flat, triangles = corners.ravel(), corners.shape[1]
    free = np.flatnonzero(flat < count)
    column = free % max(1, triangles)
    values = np.ones(len(free)) if shares is None else shares[column]
    return csr_array((values, (flat[free], column)), shape=(count, triangles))
