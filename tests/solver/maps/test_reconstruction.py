# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A map is reconstructed exactly from its own representation, on every kind of mesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Bools, Floats, Ints
from qc3d_addon.solver.errors import ReconstructionError
from qc3d_addon.solver.maps import reconstruction
from qc3d_addon.solver.maps.boundary_conditions import Conditions
from qc3d_addon.solver.maps.reconstruction import Reconstructor, reconstruct
from qc3d_addon.solver.maps.representation import (
    eigen_form,
    from_eigen_form,
    from_upper_triangle,
    polar_decomposition,
    upper_triangle,
)
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_paper.experiments import shapes
from qc3d_paper.experiments.shapes import along_axes

from ..meshes import jittered_grid, kuhn_grid, sine_map

EXACT = 1e-10
Bijection = Callable[[Floats], Floats]


def stretch_of(mesh: TetMesh, values: Floats) -> Floats:
    """The representation of a map, which must be free of folds."""
    jacobians = mesh.jacobians(values)
    assert np.linalg.det(jacobians).min() > 0.0
    return polar_decomposition(jacobians).stretch


def without_folds(mesh: TetMesh, bijection: Bijection) -> Floats:
    """A bijection's values at the vertices; damped where slivers of the mesh cannot follow it without a fold."""
    for damping in (1.0, 0.5, 0.25, 0.1, 0.05):
        values = mesh.points + damping * (bijection(mesh.points) - mesh.points)
        if np.linalg.det(mesh.jacobians(values)).min() > 0.0:
            return values
    raise AssertionError("the mesh is too bad for this map")


def boundary_vertices(mesh: TetMesh) -> Ints:
    return np.flatnonzero(mesh.on_cube_face.any(axis=1))


def held_with(mesh: TetMesh, landmarks: Ints) -> Bools:
    """The sliding boundary and all of some vertices."""
    held = mesh.on_cube_face.copy()
    held[landmarks] = True
    return held


def whirl(points: Floats) -> Floats:
    """Coarse meshes follow 60 degrees."""
    return shapes.whirl(points, 60.0)


def sliding(points: Floats) -> Floats:
    """Every face moves within itself, the inside along with it."""
    waves = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]], [[2, 0, 1], [1, 2, 0], [0, 1, 2]]])
    return sine_map(points, np.array([[0.10, -0.09, 0.08], [-0.05, 0.06, 0.05]]), waves)


def all_at_once(points: Floats) -> Floats:
    return along_axes(sliding(whirl(points)))


MAPS = [np.array, along_axes, whirl, sliding, all_at_once]


@pytest.mark.parametrize("bijection", MAPS, ids=lambda bijection: bijection.__name__)
def test_a_map_comes_back_from_its_representation(mesh: TetMesh, bijection: Bijection) -> None:
    values = without_folds(mesh, bijection)
    rebuilt = Reconstructor(mesh).rebuild(stretch_of(mesh, values), mesh.points)
    assert np.abs(rebuilt - values).max() < EXACT
    # The faces are held, not fitted.
    np.testing.assert_array_equal(rebuilt[mesh.on_cube_face], mesh.points[mesh.on_cube_face])


def test_the_faces_slide() -> None:
    mesh = jittered_grid(5, seed=2)
    values = sliding(mesh.points)
    on_faces = boundary_vertices(mesh)
    assert np.abs(values - mesh.points)[on_faces].max() > 0.05
    rebuilt = Reconstructor(mesh).rebuild(stretch_of(mesh, values), mesh.points)
    assert np.abs(rebuilt - values).max() < EXACT


@pytest.mark.parametrize("form", [(upper_triangle, from_upper_triangle), (eigen_form, from_eigen_form)])
def test_either_six_numbers_suffice(form: tuple[Bijection, Bijection]) -> None:
    mesh = jittered_grid(5, seed=3)
    values = without_folds(mesh, all_at_once)
    there, back = form
    numbers = there(stretch_of(mesh, values))
    assert numbers.shape == (len(mesh.tets), 6)
    assert np.abs(Reconstructor(mesh).rebuild(back(numbers), mesh.points) - values).max() < EXACT


def test_an_affine_map_comes_back_from_its_boundary(mesh: TetMesh) -> None:
    # The only affine map that slides on all faces is the identity: hold the whole boundary instead.
    shear = np.array([[1.3, 0.4, -0.2], [0.1, 0.8, 0.5], [-0.3, 0.2, 1.1]])
    values = mesh.points @ shear.T + np.array([0.3, -0.2, 0.1])
    landmarks = boundary_vertices(mesh)
    given_values = np.where(np.isin(np.arange(len(values)), landmarks)[:, None], values, 0.0)
    rebuilt = Reconstructor(mesh, held_with(mesh, landmarks)).rebuild(stretch_of(mesh, values), given_values)
    assert np.abs(rebuilt - values).max() < EXACT


def test_true_landmarks_change_nothing(mesh: TetMesh) -> None:
    values = without_folds(mesh, all_at_once)
    landmarks = np.random.default_rng(4).choice(len(values), 20, replace=False)
    rebuilt = Reconstructor(mesh, held_with(mesh, landmarks)).rebuild(stretch_of(mesh, values), values)
    np.testing.assert_array_equal(rebuilt[landmarks], values[landmarks])
    assert np.abs(rebuilt - values).max() < EXACT


def test_other_landmarks_are_held_and_the_rest_is_in_balance() -> None:
    mesh = jittered_grid(6, seed=5)
    landmarks = np.flatnonzero(~mesh.on_cube_face.any(axis=1))[[3, 50, 90]]
    wanted = mesh.points + np.isin(np.arange(len(mesh.points)), landmarks)[:, None] * np.array([0.05, -0.03, 0.02])
    identity = np.tile(np.eye(3), (len(mesh.tets), 1, 1))
    rebuilt = Reconstructor(mesh, held_with(mesh, landmarks)).rebuild(identity, wanted)
    np.testing.assert_array_equal(rebuilt[landmarks], wanted[landmarks])
    # With A = I the energy is Dirichlet's, whose gradient vanishes wherever nothing is held.
    forces = mesh.volumes[:, None, None] * (mesh.gradients @ mesh.jacobians(rebuilt).transpose(0, 2, 1))
    total = np.zeros_like(rebuilt)
    np.add.at(total, mesh.tets, forces)
    assert np.abs(total[~held_with(mesh, landmarks)]).max() < 1e-13
    assert np.abs(total[landmarks]).max() > 1e-3


def test_values_count_only_where_they_are_held() -> None:
    mesh = jittered_grid(4, seed=6)
    values = sliding(mesh.points)
    blank = np.where(mesh.on_cube_face, mesh.points, np.nan)
    rebuilt = Reconstructor(mesh).rebuild(stretch_of(mesh, values), blank)
    assert np.abs(rebuilt - values).max() < EXACT


def test_the_start_does_not_matter() -> None:
    mesh = jittered_grid(4, seed=7)
    values = without_folds(mesh, all_at_once)
    stretch = stretch_of(mesh, values)
    reconstructor = Reconstructor(mesh)
    for start in (values, np.zeros_like(values), np.random.default_rng(0).uniform(size=values.shape)):
        kept = start.copy()
        assert np.abs(reconstructor.rebuild(stretch, mesh.points, start) - values).max() < EXACT
        np.testing.assert_array_equal(start, kept)


def test_one_reconstructor_rebuilds_many_maps() -> None:
    mesh = jittered_grid(4, seed=8)
    reconstructor = Reconstructor(mesh)
    for bijection in (*MAPS, *MAPS[::-1]):
        values = without_folds(mesh, bijection)
        assert np.abs(reconstructor.rebuild(stretch_of(mesh, values), mesh.points) - values).max() < EXACT


def test_a_mesh_without_free_vertices() -> None:
    mesh = kuhn_grid(1)
    rebuilt = Reconstructor(mesh).rebuild(stretch_of(mesh, mesh.points), mesh.points)
    np.testing.assert_array_equal(rebuilt, mesh.points)


def test_strong_distortion() -> None:
    mesh = jittered_grid(6, seed=9)
    values = mesh.points**3
    stretch = stretch_of(mesh, values)
    assert np.linalg.cond(stretch).max() > 50.0
    assert np.abs(Reconstructor(mesh).rebuild(stretch, mesh.points) - values).max() < EXACT


@pytest.mark.parametrize("steepness", [12.0, 18.0, 24.0])
def test_very_strong_distortion(steepness: float) -> None:
    mesh = kuhn_grid(12)
    # Along x the closed form; along y and z something that moves as well.
    values = sliding(mesh.points)
    values[:, 0] = np.expm1(steepness * mesh.points[:, 0]) / np.expm1(steepness)
    stretch = stretch_of(mesh, values)
    assert np.linalg.cond(stretch).max() > 1e3
    assert np.abs(Reconstructor(mesh).rebuild(stretch, mesh.points) - values).max() < EXACT


@pytest.mark.parametrize("offset", [0.0, 2.0**10, -(2.0**20), 2.0**30])
def test_a_mesh_far_from_the_origin(offset: float) -> None:
    grid = kuhn_grid(8)  # whose coordinates have few digits: they are exact in every place
    mesh = TetMesh(grid.points + offset, grid.tets)
    shear = np.array([[1.5, 0.25, 0.0], [0.0, 0.75, 0.5], [-0.25, 0.0, 1.0]])
    values = grid.points @ shear.T + offset
    stretch = stretch_of(grid, grid.points @ shear.T)
    rebuilt = reconstruct(mesh, stretch, Conditions.fixed_boundary(mesh, values)).values
    assert np.abs(rebuilt - values).max() <= max(1e-14, np.spacing(abs(2.0 * offset)))


def test_parts_that_lie_far_apart() -> None:
    grid = kuhn_grid(6)
    near, far = grid.points, grid.points + 2.0**30
    mesh = TetMesh(np.concatenate([near, far]), np.concatenate([grid.tets, grid.tets + len(near)]))
    shape = sliding(near)
    values = np.concatenate([shape, shape + 2.0**30])
    stretch = np.tile(stretch_of(grid, shape), (2, 1, 1))
    rebuilt = reconstruct(mesh, stretch, Conditions.fixed_boundary(mesh, values)).values
    assert np.abs(rebuilt - values)[: len(near)].max() < 1e-13
    assert np.abs(rebuilt - values)[len(near) :].max() < 1e-6


waves = st.lists(st.integers(0, 3), min_size=9, max_size=9).map(lambda found: np.array(found).reshape(3, 3))
# The slope of each displacement stays below 3 pi 0.03 * 3 < 1, so that no map folds.
amplitudes = st.lists(st.floats(-0.03, 0.03), min_size=3, max_size=3)


@settings(max_examples=30)
@given(st.lists(st.tuples(amplitudes, waves), min_size=1, max_size=3), st.integers(0, 2**32 - 1))
def test_random_smooth_bijections_come_back(displacements: list[tuple[list[float], Ints]], seed: int) -> None:
    mesh = jittered_grid(5, seed)
    values = sine_map(mesh.points, *(np.array(part) for part in zip(*displacements, strict=True)))
    rebuilt = Reconstructor(mesh).rebuild(stretch_of(mesh, values), mesh.points)
    assert np.abs(rebuilt - values).max() < EXACT


class TestErrors:
    def test_a_fold_in_the_representation(self) -> None:
        mesh = kuhn_grid(2)
        stretch = np.tile(np.eye(3), (len(mesh.tets), 1, 1))
        stretch[7, 0, 0] = -0.1
        with pytest.raises(ReconstructionError, match=r"1 tetrahedra, first number 7, is not positive definite"):
            Reconstructor(mesh).rebuild(stretch, mesh.points)

    def test_a_number_that_is_none(self) -> None:
        mesh = kuhn_grid(2)
        stretch = np.tile(np.eye(3), (len(mesh.tets), 1, 1))
        stretch[7, 0, 1] = stretch[7, 1, 0] = np.nan
        with pytest.raises(ReconstructionError):
            Reconstructor(mesh).rebuild(stretch, mesh.points)

    def test_nothing_held(self) -> None:
        cube = kuhn_grid(2)
        inside = TetMesh(0.25 + 0.5 * cube.points, cube.tets)
        with pytest.raises(ReconstructionError, match="held nowhere"):
            Reconstructor(inside)
        Reconstructor(inside, held_with(inside, np.array([0])))

    def test_an_iteration_that_does_not_end(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(reconstruction, "_MOST_ITERATIONS", 2)
        mesh = kuhn_grid(4)
        with pytest.raises(ReconstructionError, match="did not converge"):
            Reconstructor(mesh).rebuild(stretch_of(mesh, all_at_once(mesh.points)), mesh.points)
