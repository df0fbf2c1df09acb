# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The enclosed volumes of a surface of which only some vertices move, and their gradients."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Floats, Ints
from ..numerics.grouped_sums import sums_by_label
from ..triangles.closed_volume import ClosedComponents, volumes_seen_from
from ..triangles.geometry import cross_product
from ..triangles.topology import distinct


class MovingVolumes:
    """The volumes of closed components of which some vertices move.

    Only triangles with a moving corner are looked at again and again; what the others enclose is counted once.

    Parameters
    ----------
    closed : ClosedComponents
    covering : tuple of (t, 3) int64 and (t,)
        Triangles that cover the surface evenly, and what each counts, for directions that favor no diagonal of a quad.
    moving : (k,) int64
        The vertices that move.
    used : (l,) int64
        The vertices whose positions are given: the moving ones first, then at least all that share a triangle with
        them.
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
        # Each component is seen from one of its corners, one that rests if there is one: what rests looks the same.
        corners = distinct(faces.ravel())
        corners = corners[np.lexsort((moves[corners], closed.labels[corners]))]
        labels, first = np.unique(closed.labels[corners], return_index=True)
        self._components = int(closed.labels.max(initial=-1)) + 1
        self._views = np.zeros(self._components, dtype=np.int64)
        self._views[labels] = corners[first]
        # The corners of each triangle, and where it is seen from.
        self._looked_at = np.concatenate([self._corners, number[self._views[self._label_of_face]][None]])
        self._incidence = _incidence(self._corners, len(moving))
        triangles, shares = covering
        touched = closed.among(triangles) & moves[triangles].any(axis=1)
        self._even_corners: Ints = np.ascontiguousarray(number[triangles[touched]].T)
        self._even_incidence = _incidence(self._even_corners, len(moving), shares[touched])

    @property
    def empty(self) -> bool:
        """Whether no closed component moves."""
        return not self._corners.size

    def resting(self, positions: Floats) -> Floats:
        """(components,) what triangles without a moving corner enclose; positions (n, 3) of all vertices."""
        return volumes_seen_from(positions[self._views], positions, self._resting, self._labels)

    def with_slope(self, positions: Floats) -> tuple[Floats, Floats]:
        """(components,) what triangles with a moving corner enclose, and (3, k) how volumes change with what moves.

        Parameters
        ----------
        positions : (3, l)
            Of the used vertices.
        """
        seen = np.empty((3, *self._looked_at.shape))
        for axis in range(3):
            np.take(positions[axis], self._looked_at, out=seen[axis], mode="clip")
        first, second, third, view = seen.transpose(1, 0, 2)
        normals = cross_product(second - first, third - first)
        shares = ((first - view) * normals).sum(axis=0)
        volumes = sums_by_label(self._label_of_face, shares, self._components) / 6.0
        return volumes, np.stack([self._incidence @ normal for normal in normals]) / 6.0

    def even_slope(self, positions: Floats) -> Floats:
        """(3, k) how volumes change with what moves, polygons taken as the mean of all ways to triangulate them."""
        first, second, third = (positions[:, corners] for corners in self._even_corners)
        normals = cross_product(second - first, third - first)
        return np.asarray(np.stack([self._even_incidence @ normal for normal in normals]) / 6.0)

    def changes(self, slope: Floats, moves: Floats) -> Floats:
        """(components,) what volumes gain, to first order, where vertices move by ``moves`` (3, k)."""
        return sums_by_label(self._label_of_vertex, (slope * moves).sum(axis=0), self._components)

    def stepped(self, moved: Floats, direction: Floats, slope: Floats, missing: Floats) -> Floats:
        """Positions (3, k) moved along ``direction`` so far that, to first order, volumes gain what is missing."""
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
