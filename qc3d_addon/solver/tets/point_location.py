# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Point location in tetrahedral meshes: the tetrahedron that contains each point, and its barycentric weights."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints
from ..errors import MeshingError
from .mesh import TetMesh

ROUNDING = 1e-12  # a weight this little below zero still counts as inside: the point lies on a face
TOLERANCE = 1e-9  # no weight below minus this is ever returned
_CANDIDATES = 64  # nearest centroids tried for points that the walk does not find; nearly always enough


def locate(mesh: TetMesh, points: Floats) -> tuple[Ints, Floats]:
    """Find the tetrahedron that contains each point.

    The visibility walk of Devillers, Pion & Teillaud, for all points at once: start at the nearest centroid and keep
    crossing a face that separates the tetrahedron from the point. In meshes that are not Delaunay the walk may cycle;
    such points are searched among the nearest tetrahedra, then among all.

    Parameters
    ----------
    mesh : TetMesh
        A mesh of a convex domain, such as the cube.
    points : (n, 3) float64
        Points in the mesh's units.

    Returns
    -------
    tets : (n,) int64
        Index of the tetrahedron that contains each point.
    weights : (n, 4) float64
        Barycentric weights; they sum to 1, and none is below -1e-9.

    Raises
    ------
    MeshingError
        If a point is not finite or lies outside the mesh.

    References
    ----------
    Devillers, Pion & Teillaud, "Walking in a triangulation", 2002.

    Examples
    --------
    >>> import numpy as np
    >>> from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid
    >>> tets, weights = locate(kuhn_grid(1), np.array([[0.5, 0.5, 0.5]]))
    >>> bool(abs(weights.sum() - 1.0) < 1e-12)
    True
    """
    points = np.asarray(points, dtype=np.float64)
    lowest, highest = mesh.points.min(axis=0), mesh.points.max(axis=0)
    # Tested as "inside", since a comparison with NaN is false.
    _require_inside(points, ((points >= lowest - TOLERANCE) & (points <= highest + TOLERANCE)).all(axis=1))
    tree = cKDTree(mesh.centroids)
    tets = np.asarray(tree.query(points)[1], dtype=np.int64)
    lost = _walk(mesh, points, tets)
    lost = lost[~_choose_among_nearest(mesh, points, tets, lost, tree)]
    for point in lost:
        tets[point] = _search_everywhere(mesh, points[point])
    weights = barycentric(mesh, tets, points)
    _require_inside(points, weights.min(axis=1) >= -TOLERANCE)
    return tets, weights


def interpolation_matrix(mesh: TetMesh, points: Floats) -> csr_array:
    """Sparse matrix B that interpolates vertex values at ``points``; B @ mesh.points = points.

    Parameters
    ----------
    mesh : TetMesh
        N vertices; a mesh of a convex domain.
    points : (n, 3) float64
        Points in the mesh's units.

    Returns
    -------
    (n, N) sparse
        Four barycentric weights in each row.

    Raises
    ------
    MeshingError
        If a point is not finite or lies outside the mesh.

    Examples
    --------
    >>> import numpy as np
    >>> from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid
    >>> grid = kuhn_grid(2)
    >>> interpolation_matrix(grid, np.array([[0.3, 0.4, 0.1]])) @ grid.points
    array([[0.3, 0.4, 0.1]])
    """
    tets, weights = locate(mesh, points)
    starts = np.arange(0, 4 * len(tets) + 1, 4)
    return csr_array((weights.ravel(), mesh.tets[tets].ravel(), starts), shape=(len(tets), len(mesh.points)))


def barycentric(mesh: TetMesh, tets: Ints, points: Floats) -> Floats:
    """(..., 4) barycentric weights of points (..., 3) in the tetrahedra with indices ``tets`` (...).

    They sum to 1; some are negative where a point lies outside. They are computed relative to the first corner, so that
    weights @ corners reproduces the point to rounding.
    """
    offsets = points - mesh.points[mesh.tets[tets, 0]]
    others = np.einsum("...ka,...a->...k", mesh.gradients[tets, 1:], offsets)
    return np.concatenate([1.0 - others.sum(axis=-1, keepdims=True), others], axis=-1)


def _require_inside(points: Floats, inside: Bools) -> None:
    outside = np.flatnonzero(~inside)
    if outside.size:
        raise MeshingError(
            f"Point {outside[0]} at {points[outside[0]]} lies outside the tetrahedral mesh "
            f"({outside.size} such points in all)."
        )


def _walk(mesh: TetMesh, points: Floats, tets: Ints) -> Ints:
    """Walk from ``tets`` (n,), in place, to the points; return the indices of points that were not reached."""
    active = np.arange(len(points))
    for _ in range(20 + 4 * round(len(mesh.tets) ** (1 / 3))):
        if not active.size:
            break
        weights = barycentric(mesh, tets[active], points[active])
        # There is nothing behind a boundary face: take another face that the point is behind.
        weights[(mesh.neighbors[tets[active]] < 0) & (weights < -ROUNDING)] = 0.0
        corner = weights.argmin(axis=1)
        behind = weights.min(axis=1) < -ROUNDING
        active, corner = active[behind], corner[behind]
        tets[active] = mesh.neighbors[tets[active], corner]
    inside = barycentric(mesh, tets, points).min(axis=1) >= -ROUNDING
    return np.flatnonzero(~inside)


def _choose_among_nearest(mesh: TetMesh, points: Floats, tets: Ints, lost: Ints, tree: cKDTree) -> Bools:
    """Give each lost point the best of the nearest tetrahedra; return which of them are thereby found."""
    if not lost.size:
        return np.empty(0, dtype=bool)
    nearest = np.asarray(tree.query(points[lost], k=min(_CANDIDATES, len(mesh.tets)))[1]).reshape(len(lost), -1)
    candidates = np.concatenate([tets[lost, None], nearest], axis=1)
    smallest = barycentric(mesh, candidates, points[lost, None]).min(axis=-1)
    best = smallest.argmax(axis=1)
    rows = np.arange(len(lost))
    tets[lost] = candidates[rows, best]
    return np.asarray(smallest[rows, best] >= -TOLERANCE)


def _search_everywhere(mesh: TetMesh, point: Floats) -> int:
    """The tetrahedron of the whole mesh whose smallest weight for the point is largest."""
    smallest = barycentric(mesh, np.arange(len(mesh.tets)), np.broadcast_to(point, (len(mesh.tets), 3))).min(axis=1)
    return int(smallest.argmax())
