# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine ``delaunay``: well-shaped tetrahedra, and the same mesh for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.meshing.delaunay import delaunay_mesh
from qc3d_addon.solver.meshing.poisson_disk import RESOLUTIONS, Resolution
from qc3d_addon.solver.meshing.slivers import WANTED_ANGLE, sliver_free, smallest_dihedral_angles, triangulate
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import icosphere, kuhn_grid

NORMAL = RESOLUTIONS["normal"]


def test_the_same_input_and_seed_give_the_same_mesh() -> None:
    first, second = (delaunay_mesh(*icosphere(2, 0.15), NORMAL, FitOptions(seed=7)) for _ in range(2))
    assert np.array_equal(first.points, second.points)
    assert np.array_equal(first.tets, second.tets)


def test_another_seed_gives_another_mesh() -> None:
    first, second = (delaunay_mesh(*icosphere(2, 0.15), NORMAL, FitOptions(seed=seed)) for seed in (0, 1))
    assert first.points.shape != second.points.shape or not np.array_equal(first.points, second.points)


@pytest.mark.parametrize("seed", range(5))
def test_no_sliver_is_left(seed: int) -> None:
    mesh = delaunay_mesh(*icosphere(2, 0.15), NORMAL, FitOptions(seed=seed))
    assert smallest_dihedral_angles(mesh).min() >= 0.7 * WANTED_ANGLE  # in few rounds, on a steep grading


def test_slivers_of_a_regular_grid_are_removed() -> None:
    """Co-spherical samples: the Delaunay tetrahedra of a cubic grid are ambiguous, and some have no volume."""
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    random = np.random.default_rng(0)
    mesh = sliver_free(grid, Resolution(0.1, 0.0, 0.1).around(grid), random)
    assert smallest_dihedral_angles(mesh).min() > 5.0
    assert mesh.volumes.sum() == pytest.approx(1.0, abs=1e-12)


def test_samples_on_the_cube_keep_to_its_faces_edges_and_corners() -> None:
    random = np.random.default_rng(2)
    samples = random.uniform(0.1, 0.9, (400, 3))
    samples[:90, 0], samples[90:120, 1:] = 1.0, 0.0
    samples = np.concatenate([kuhn_grid(1).points, samples])
    moved = sliver_free(samples, Resolution(0.15, 0.0, 0.15).around(samples), random).points
    for exact in (0.0, 1.0):
        assert np.array_equal(moved == exact, samples == exact)


def test_triangulation_of_the_corners_is_the_cube() -> None:
    corners = kuhn_grid(1).points
    mesh = TetMesh(corners, triangulate(corners))
    assert (mesh.volumes > 0.0).all()
    assert mesh.volumes.sum() == pytest.approx(1.0, abs=1e-15)
    assert len(mesh.boundary_faces) == 12


def test_dihedral_angles_of_known_tetrahedra() -> None:
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    regular = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    double = np.array([[0.0, 0, 0], [0, 0, 0], [1, 1, 0], [0, 1, 1]])
    expected = [np.degrees(np.arccos(3**-0.5)), np.degrees(np.arccos(1.0 / 3.0)), 0.0, 0.0]
    shapes = np.concatenate([corner, regular, flat, double])
    angles = smallest_dihedral_angles(TetMesh(shapes, np.arange(16).reshape(4, 4)))
    np.testing.assert_allclose(angles, expected, atol=1e-6)
