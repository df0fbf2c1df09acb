# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Point location: every point is found with the right weights, and points outside are refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from qc3d_addon.solver.errors import MeshingError
from qc3d_addon.solver.tets import point_location
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_addon.solver.tets.point_location import barycentric, interpolation_matrix, locate

from ..meshes import jittered_grid, random_delaunay

CUBE_POINTS = arrays(np.float64, st.tuples(st.integers(1, 40), st.just(3)), elements=st.floats(0.0, 1.0))
DELAUNAY, JITTERED = random_delaunay(150, seed=2), jittered_grid(5, seed=1)


def assert_located(mesh: TetMesh, points: np.ndarray) -> None:
    tets, weights = locate(mesh, points)
    assert tets.shape == (len(points),)
    assert tets.dtype == np.int64
    assert weights.min() >= -1e-9
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=4e-16)
    np.testing.assert_allclose(np.einsum("nk,nka->na", weights, mesh.points[mesh.tets[tets]]), points, atol=2e-15)


@pytest.mark.parametrize("mesh_here", [DELAUNAY, JITTERED], ids=["delaunay", "jittered grid"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(points=CUBE_POINTS)
def test_any_point_of_the_cube_is_found_and_reproduced(mesh_here: TetMesh, points: np.ndarray) -> None:
    assert_located(mesh_here, points)


def test_random_points_in_every_kind_of_mesh(mesh: TetMesh) -> None:
    assert_located(mesh, np.random.default_rng(0).uniform(size=(3000, 3)))


def test_vertices_and_points_on_edges_faces_and_the_boundary(mesh: TetMesh) -> None:
    corners = mesh.points[mesh.tets]
    on_cube = np.random.default_rng(1).uniform(size=(600, 3))
    on_cube[np.arange(600), np.arange(600) % 3] = np.arange(600) % 2
    assert_located(mesh, np.concatenate([mesh.points, corners[:, :2].mean(axis=1), corners[:, 1:].mean(axis=1)]))
    assert_located(mesh, on_cube)


def test_centroids_are_found_in_their_own_tetrahedra(mesh: TetMesh) -> None:
    tets, weights = locate(mesh, mesh.centroids)
    assert np.array_equal(tets, np.arange(len(mesh.tets)))
    np.testing.assert_allclose(weights, 0.25, atol=1e-9)


def test_the_matrix_interpolates_linear_functions_exactly(mesh: TetMesh) -> None:
    points = np.random.default_rng(2).uniform(size=(500, 3))
    matrix = interpolation_matrix(mesh, points)
    assert matrix.shape == (500, len(mesh.points))
    assert matrix.format == "csr"
    slope, offset = np.array([[1.0, -2.0, 0.5], [0.0, 3.0, 1.0], [-1.0, 0.2, 0.7]]), np.array([0.1, -0.2, 0.3])
    np.testing.assert_allclose(matrix @ (mesh.points @ slope + offset), points @ slope + offset, atol=1e-14)


def test_points_whose_walk_does_not_arrive_are_found_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walks that go round in circles, and nearest tetrahedra that do not help: the whole mesh is searched."""
    points = np.random.default_rng(3).uniform(size=(50, 3))
    expected = locate(DELAUNAY, points)[0]

    def astray(mesh: TetMesh, points: np.ndarray, tets: np.ndarray) -> np.ndarray:
        tets[:] = 0
        return np.arange(len(points))

    monkeypatch.setattr(point_location, "_walk", astray)
    assert np.array_equal(locate(DELAUNAY, points)[0], expected)
    monkeypatch.setattr(point_location, "_CANDIDATES", 1)
    assert np.array_equal(locate(DELAUNAY, points)[0], expected)


@pytest.mark.parametrize("outside", [[0.5, 0.5, 1.0 + 1e-6], [-0.2, 0.5, 0.5], [np.nan, 0.5, 0.5], [0.5, np.inf, 0.5]])
def test_points_outside_are_refused(outside: list[float]) -> None:
    with pytest.raises(MeshingError, match=r"Point 1 .* outside"):
        locate(DELAUNAY, np.array([[0.5, 0.5, 0.5], outside]))


def test_a_point_in_a_hole_is_refused() -> None:
    """Never a wrong tetrahedron: the mesh's bounding box holds the point, the mesh does not."""
    hollow = TetMesh(JITTERED.points, JITTERED.tets[np.abs(JITTERED.centroids - 0.5).max(axis=1) > 0.2])
    with pytest.raises(MeshingError, match="outside"):
        locate(hollow, np.array([[0.5, 0.5, 0.5]]))


def test_no_points() -> None:
    tets, weights = locate(DELAUNAY, np.empty((0, 3)))
    assert tets.shape == (0,)
    assert weights.shape == (0, 4)


def test_weights_outside_are_negative() -> None:
    beyond = DELAUNAY.points[DELAUNAY.tets[:1, 0]] * 2.0 - DELAUNAY.centroids[:1]
    assert barycentric(DELAUNAY, np.array([0]), beyond).min() < 0.0
