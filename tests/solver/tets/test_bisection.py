# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bisection: meshes stay whole, and maps stay what they were."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.meshing.cube import require_filled_cube
from qc3d_addon.solver.numerics.rotations import determinants
from qc3d_addon.solver.tets.bisection import bisected
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_addon.solver.tets.point_location import interpolation_matrix

from ..meshes import jittered_grid, random_delaunay


@pytest.mark.parametrize("mesh", [random_delaunay(150, seed=2), jittered_grid(5, seed=1)], ids=["delaunay", "grid"])
def test_the_mesh_stays_whole_and_maps_stay_what_they_were(mesh: TetMesh) -> None:
    rng = np.random.default_rng(0)
    maps = np.stack([mesh.points, mesh.points + 0.01 * rng.normal(size=mesh.points.shape)])
    places = rng.uniform(size=(200, 3))
    before = interpolation_matrix(mesh, places) @ maps[1]
    least = determinants(mesh.jacobians(maps[1])).min()
    marked = np.linalg.norm(mesh.centroids - 0.4, axis=1) < 0.2
    finer = mesh
    for _ in range(4):
        finer, maps, parents = bisected(finer, marked, maps)
        assert np.bincount(parents).max() == 2
        marked = marked[parents]
    require_filled_cube(finer)
    np.testing.assert_array_equal(finer.points[: len(mesh.points)], mesh.points)
    np.testing.assert_array_equal(finer.points, maps[0])
    np.testing.assert_allclose(interpolation_matrix(finer, places) @ maps[1], before, atol=1e-14)
    np.testing.assert_allclose(determinants(finer.jacobians(maps[1])).min(), least, rtol=1e-9)


def test_marked_tetrahedra_become_smaller_and_those_far_away_stay() -> None:
    mesh = jittered_grid(6, seed=1)
    finer, maps = mesh, mesh.points[None]
    marked = np.linalg.norm(mesh.centroids - 0.5, axis=1) < 0.15
    far = np.linalg.norm(mesh.centroids - 0.5, axis=1) > 0.5
    inside, away = marked.copy(), far.copy()
    for _ in range(6):
        finer, maps, parents = bisected(finer, inside, maps)
        inside, away = inside[parents], away[parents]
    assert finer.volumes[inside].max() <= 0.26 * mesh.volumes[marked].max()
    assert np.count_nonzero(away) == np.count_nonzero(far)


def test_where_nothing_is_marked_nothing_changes() -> None:
    mesh = jittered_grid(3, seed=1)
    finer, _, parents = bisected(mesh, np.zeros(len(mesh.tets), dtype=bool), mesh.points[None])
    np.testing.assert_array_equal(finer.tets, mesh.tets)
    np.testing.assert_array_equal(parents, np.arange(len(mesh.tets)))
