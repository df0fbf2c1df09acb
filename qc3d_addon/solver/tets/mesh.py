# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tetrahedral meshes of the unit cube: volumes, gradients, adjacency."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..errors import MeshingError

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Corners of the face opposite each corner, ordered so that its normal points out of a positively oriented tetrahedron.
OPPOSITE_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@dataclass(frozen=True, eq=False)
class TetMesh:
    """A conforming tetrahedral mesh with positive orientation.

    Parameters
    ----------
    points : (N, 3) float64
        Vertex positions.
    tets : (M, 4) int64
        Vertex indices of the tetrahedra; det(p1 - p0, p2 - p0, p3 - p0) > 0 for each row.
    """

    points: Floats
    tets: Ints

    @cached_property
    def edge_matrices(self) -> Floats:
        """(M, 3, 3) matrices with columns p1 - p0, p2 - p0, p3 - p0."""
        return edge_matrices(self.points, self.tets)

    @cached_property
    def volumes(self) -> Floats:
        """(M,) signed volumes, as fractions of the cube."""
        return np.asarray(np.linalg.det(self.edge_matrices) / 6.0)

    @cached_property
    def gradients(self) -> Floats:
        """(M, 4, 3) gradients of the four hat functions of each tetrahedron."""
        inner = np.linalg.inv(self.edge_matrices)
        return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)

    @cached_property
    def centroids(self) -> Floats:
        """(M, 3) centroids of the tetrahedra."""
        return np.asarray(self.points[self.tets].mean(axis=1))

    @cached_property
    def neighbors(self) -> Ints:
        """(M, 4) neighbor across the face opposite each corner, -1 on the boundary.

        Raises
        ------
        MeshingError
            If a face belongs to more than two tetrahedra.
        """
        corners = np.sort(self.tets[:, OPPOSITE_FACES].reshape(-1, 3), axis=1)
        order = np.lexsort(corners.T[::-1])
        ordered = corners[order]
        same = (ordered[1:] == ordered[:-1]).all(axis=1)
        if (same[1:] & same[:-1]).any():
            raise MeshingError("A face of the tetrahedral mesh belongs to more than two tetrahedra; mesh again.")
        first, second = order[:-1][same], order[1:][same]
        across = np.full(corners.shape[0], -1, dtype=np.int64)
        across[first], across[second] = second // 4, first // 4
        return across.reshape(-1, 4)

    @cached_property
    def boundary_faces(self) -> Ints:
        """(F, 3) boundary triangles, with normals pointing out."""
        tet, corner = np.nonzero(self.neighbors < 0)
        return np.asarray(self.tets[tet[:, None], OPPOSITE_FACES[corner]])

    @cached_property
    def on_cube_face(self) -> Bools:
        """(N, 3) whether each coordinate of a vertex is exactly 0 or 1, that is, fixed by the sliding boundary."""
        return np.asarray((self.points == 0.0) | (self.points == 1.0))

    @cached_property
    def gradient_operator(self) -> csr_array:
        """(3M, N) sparse: takes vertex values to their derivatives along x on all tetrahedra, then along y, then z."""
        # Imported here because this module's types are used where scipy must not be loaded yet.
        from ..numerics.assembly import gradient_operator

        return gradient_operator(self.tets, self.gradients, len(self.points))

    @cached_property
    def incidence(self) -> csr_array:
        """(N, M) sparse: 1 where a vertex is a corner of a tetrahedron."""
        from scipy.sparse import coo_array

        owners = np.repeat(np.arange(len(self.tets)), 4)
        shape = (len(self.points), len(self.tets))
        return coo_array((np.ones(len(owners)), (self.tets.ravel(), owners)), shape=shape).tocsr()

    @cached_property
    def parts(self) -> tuple[Ints, int]:
        """(N,) the connected part of each vertex, -1 for vertices of no tetrahedron; and how many parts there are."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        count = len(self.points)
        rows, columns = np.repeat(self.tets[:, 0], 3), self.tets[:, 1:].ravel()
        graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
        _, labels = connected_components(graph, directed=False)
        used = np.zeros(count, dtype=bool)
        used[self.tets] = True
        part = np.full(count, -1, dtype=np.int64)
        known, part[used] = np.unique(labels[used], return_inverse=True)
        return part, len(known)

    def jacobians(self, values: Floats) -> Floats:
        """(M, 3, 3) Jacobians of the map that sends ``points`` to ``values`` (N, 3); component-major."""
        rows = [self.gradient_operator @ coordinate for coordinate in np.ascontiguousarray(values.T)]
        return np.asarray(np.moveaxis(np.stack(rows).reshape(3, 3, -1), -1, 0))

    def divergence(self, fields: Floats) -> Floats:
        """(N, 3) the transpose of ``jacobians``, applied to fields of matrices (M, 3, 3).

        It is minus the weak divergence of the rows if the fields are multiplied by the volumes.
        """
        rows = np.moveaxis(fields, 0, -1).reshape(3, -1)
        return np.stack([self.gradient_operator.T @ row for row in rows], axis=1)


def edge_matrices(points: Floats, tets: Ints) -> Floats:
    """(M, 3, 3) matrices whose columns are the edges from corner 0 to corners 1, 2, 3."""
    corners = points[tets]
    return np.ascontiguousarray((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
