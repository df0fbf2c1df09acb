# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fold-free fit: derivatives against differences, no folds for any target, landmarks met where possible."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.fit import fold_free
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fold_free import LANDMARK_WEIGHT, FoldFreeFitter
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.assembly import StiffnessPattern
from qc3d_addon.solver.numerics.rotations import cofactors, determinants
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_addon.solver.tets.point_location import interpolation_matrix

from ..meshes import icosphere, jittered_grid, sine_map

MESH = jittered_grid(6, seed=1)
LANDMARKS = np.random.default_rng(2).uniform(0.2, 0.8, (150, 3))
WAVES = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]]])


def fitter_of(mesh: TetMesh = MESH, landmarks: Floats = LANDMARKS) -> FoldFreeFitter:
    weights = np.random.default_rng(3).uniform(0.5, 1.5, len(landmarks))
    return FoldFreeFitter(mesh, interpolation_matrix(mesh, landmarks), weights / weights.sum())


def smooth(points: Floats, size: float = 0.08) -> Floats:
    return sine_map(points, size * np.array([[1.0, -1.0, 0.8]]), WAVES)


def rough(seed: int) -> Floats:
    """Values of a map without folds, every vertex somewhere at random."""
    random = np.random.default_rng(seed)
    values = MESH.points + np.where(MESH.on_cube_face, 0.0, random.uniform(-0.02, 0.02, MESH.points.shape))
    assert determinants(MESH.jacobians(values)).min() > 0.1
    return values


def direction(seed: int) -> Floats:
    """A displacement that keeps the cube's faces."""
    return np.asarray(np.random.default_rng(seed).normal(size=MESH.points.shape) * ~MESH.on_cube_face)


def energy(fitter: FoldFreeFitter, values: Floats, targets: Floats) -> float:
    return fitter._energy(values, fitter.misfit(MESH.points, targets))


def model(fitter: FoldFreeFitter, values: Floats, targets: Floats) -> tuple[float, Floats, Floats]:
    return fitter._model(values, fitter.misfit(MESH.points, targets))


def assert_a_map_of_the_cube(mesh: TetMesh, values: Floats) -> None:
    assert determinants(mesh.jacobians(values)).min() > 0.0
    np.testing.assert_array_equal(values[mesh.on_cube_face], mesh.points[mesh.on_cube_face])


class TestEnergy:
    def test_its_formula(self) -> None:
        fitter, values, targets = fitter_of(), rough(1), smooth(LANDMARKS)
        jacobians = MESH.jacobians(values)
        determinant = np.linalg.det(jacobians)
        shape = (jacobians**2).sum(axis=(1, 2)) / (3.0 * np.cbrt(determinant) ** 2)
        volume = (determinant**2 + 1.0) / (2.0 * determinant)
        missed = ((fitter.landmarks @ values - targets) ** 2).sum(axis=1)
        expected = MESH.volumes @ (0.5 * shape + 0.5 * volume) + 0.5 * LANDMARK_WEIGHT * fitter._weights @ missed
        assert energy(fitter, values, targets) == pytest.approx(expected, rel=1e-12)

    def test_the_identity_has_the_least(self) -> None:
        fitter = fitter_of()
        least = energy(fitter, MESH.points, LANDMARKS)
        assert least == pytest.approx(1.0, abs=1e-12)
        assert all(energy(fitter, rough(seed), LANDMARKS) > least for seed in range(5))

    def test_infinite_where_there_is_a_fold(self) -> None:
        fitter, values = fitter_of(), MESH.points.copy()
        inside = np.flatnonzero(~MESH.on_cube_face.any(axis=1))[40]
        values[inside] += 0.5
        assert energy(fitter, values, LANDMARKS) == np.inf
        collapsed = np.full_like(values, 0.5)
        assert energy(fitter, collapsed, LANDMARKS) == np.inf

    @pytest.mark.parametrize("seed", range(3))
    def test_gradient_against_central_differences(self, seed: int) -> None:
        fitter, values, targets = fitter_of(), rough(seed), smooth(LANDMARKS)
        found, gradient, _ = model(fitter, values, targets)
        assert found == pytest.approx(energy(fitter, values, targets), rel=1e-13)
        for number in range(5):
            along = direction(number)
            step = 1e-6
            difference = energy(fitter, values + step * along, targets) - energy(fitter, values - step * along, targets)
            assert float((gradient * along).sum()) == pytest.approx(difference / (2.0 * step), rel=1e-6)

    def test_gradient_vertex_by_vertex(self) -> None:
        fitter, values, targets = fitter_of(), rough(7), smooth(LANDMARKS)
        gradient = model(fitter, values, targets)[1]
        assert (gradient[MESH.on_cube_face] == 0.0).all()
        for vertex, axis in np.argwhere(~MESH.on_cube_face)[::37]:
            step = np.zeros_like(values)
            step[vertex, axis] = 1e-6
            difference = energy(fitter, values + step, targets) - energy(fitter, values - step, targets)
            assert gradient[vertex, axis] == pytest.approx(difference / 2e-6, rel=1e-5, abs=1e-8)


class TestHessian:
    @pytest.mark.parametrize("seed", range(3))
    def test_element_blocks_are_symmetric_and_positive(self, seed: int) -> None:
        values = rough(seed) if seed else smooth(MESH.points, 0.12)
        assert_a_map_of_the_cube(MESH, values)
        blocks = model(fitter_of(), values, LANDMARKS)[2]
        matrices = blocks.transpose(0, 1, 3, 2, 4).reshape(-1, 12, 12)
        np.testing.assert_allclose(matrices, matrices.transpose(0, 2, 1), rtol=0.0, atol=1e-12 * np.abs(matrices).max())
        eigenvalues = np.linalg.eigvalsh(matrices)
        assert (eigenvalues[:, 0] > -1e-13 * eigenvalues[:, -1]).all()
        # Three translations cost nothing, every other motion of a tetrahedron does.
        assert (eigenvalues[:, 3] > 0.0).all()

    def test_exact_at_the_identity(self) -> None:
        # The second derivative of det, which the blocks leave out, sums to zero there for a fixed boundary.
        fitter, along = fitter_of(), direction(1)
        product = self.times(fitter, MESH.points, along)
        step = 1e-5
        ahead, behind = (model(fitter, MESH.points + sign * step * along, LANDMARKS)[1] for sign in (1.0, -1.0))
        difference = (ahead - behind) / (2.0 * step)
        free = ~MESH.on_cube_face
        np.testing.assert_allclose(product[free], difference[free], rtol=0.0, atol=1e-6 * np.abs(difference).max())

    def test_differs_from_gradient_differences_by_the_curvature_of_det_alone(self) -> None:
        fitter, values, along = fitter_of(), smooth(MESH.points, 0.03), direction(2)
        step = 1e-5
        ahead, behind = (model(fitter, values + sign * step * along, LANDMARKS)[1] for sign in (1.0, -1.0))
        jacobians, change = MESH.jacobians(values), MESH.jacobians(along)
        determinant = determinants(jacobians)
        squares = np.einsum("mij,mij->m", jacobians, jacobians)
        slope = -squares / (9.0 * determinant ** (5.0 / 3.0)) + 0.25 * (1.0 - determinant**-2)
        # The cofactor matrix is quadratic, so its central difference is exact.
        bending = 0.5 * (cofactors(jacobians + change) - cofactors(jacobians - change))
        expected = (ahead - behind) / (2.0 * step) - MESH.divergence((MESH.volumes * slope)[:, None, None] * bending)
        product = self.times(fitter, values, along)
        free = ~MESH.on_cube_face
        np.testing.assert_allclose(product[free], expected[free], rtol=0.0, atol=1e-6 * np.abs(expected).max())

    @staticmethod
    def times(fitter: FoldFreeFitter, values: Floats, along: Floats) -> Floats:
        blocks = model(fitter, values, LANDMARKS)[2]
        elements = np.asarray(StiffnessPattern(MESH.tets, len(MESH.points)).assemble_blocks(blocks) @ along.ravel())
        landmarks = fitter.landmarks.T @ (fitter._weights[:, None] * (fitter.landmarks @ along))
        return np.asarray(elements.reshape(-1, 3) + LANDMARK_WEIGHT * landmarks)


IMPOSSIBLE: dict[str, Callable[[Floats], Floats]] = {
    "mirrored": lambda points: points * [-1.0, 1.0, 1.0] + [1.0, 0.0, 0.0],
    "inside out": lambda points: 1.0 - points,
    "in one point": lambda points: np.full_like(points, 0.5),
    "in one plane": lambda points: points * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.5],
    "far outside": lambda points: 10.0 * points,
    "at random": lambda points: np.random.default_rng(0).permutation(points),
}


class TestFit:
    @pytest.mark.parametrize("target", IMPOSSIBLE)
    def test_never_a_fold_on_the_way_to_an_impossible_target(self, target: str) -> None:
        fitter, targets = fitter_of(), IMPOSSIBLE[target](LANDMARKS)
        values = fitter.fit(MESH.points, targets, 15)
        assert_a_map_of_the_cube(MESH, values)
        assert energy(fitter, values, targets) < energy(fitter, MESH.points, targets)

    def test_landmarks_of_a_smooth_map_are_reached(self, mesh: TetMesh) -> None:
        fitter = fitter_of(mesh)
        # Halfway where slivers would fold: there must be a map of this mesh that meets the targets exactly.
        wanted = [mesh.points + size * (smooth(mesh.points) - mesh.points) for size in (1.0, 0.5, 0.2)]
        wanted = [values for values in wanted if determinants(mesh.jacobians(values)).min() > 0.0]
        targets = fitter.landmarks @ wanted[0]
        values = fitter.fit(mesh.points, targets, 40)
        assert_a_map_of_the_cube(mesh, values)
        missed, way = (np.linalg.norm(one, axis=1) for one in (fitter.residuals(values, targets), targets - LANDMARKS))
        assert missed.max() < 0.05 * way.max()

    def test_what_is_missed_is_the_give_of_the_springs(self, monkeypatch: pytest.MonkeyPatch) -> None:
        fitter = fitter_of()
        targets = fitter.landmarks @ smooth(MESH.points)
        missed = []
        for weight in (LANDMARK_WEIGHT, 100.0 * LANDMARK_WEIGHT):
            monkeypatch.setattr(fold_free, "LANDMARK_WEIGHT", weight)
            missed.append(np.abs(fitter.residuals(fitter.fit(MESH.points, targets, 40), targets)).max())
        # In inverse proportion to their stiffness in the end.
        assert missed[1] < 0.1 * missed[0]

    def test_the_surface_of_a_sphere_grows_and_shrinks(self) -> None:
        points = icosphere(2, radius=0.2)[0]
        fitter = fitter_of(MESH, points)
        for factor in (0.7, 1.5):
            targets = 0.5 + factor * (points - 0.5)
            values = fitter.fit(MESH.points, targets, 40)
            assert_a_map_of_the_cube(MESH, values)
            radii = np.linalg.norm(fitter.landmarks @ values - 0.5, axis=1)
            np.testing.assert_allclose(radii, 0.2 * factor, rtol=0.03)

    def test_energy_decreases_step_by_step(self) -> None:
        fitter, targets = fitter_of(), smooth(LANDMARKS, 0.12)
        values, energies = MESH.points, [energy(fitter, MESH.points, targets)]
        for _ in range(8):
            values = fitter.fit(values, targets, 1)
            energies.append(energy(fitter, values, targets))
        assert (np.diff(energies) <= 1e-14 * energies[0]).all()  # but for rounding
        assert energies[-1] < 0.1 * energies[0]
        assert energies[-1] - energies[-2] > -1e-3 * energies[-1]

    def test_it_ends_where_the_gradient_vanishes(self) -> None:
        fitter, targets = fitter_of(), smooth(LANDMARKS)
        before = np.abs(model(fitter, MESH.points, targets)[1]).max()
        values = MESH.points
        for _ in range(10):
            values = fitter.fit(values, targets, 40)
        assert np.abs(model(fitter, values, targets)[1]).max() < 1e-4 * before

    def test_nothing_to_do_leaves_the_identity(self, mesh: TetMesh) -> None:
        values = fitter_of(mesh).fit(mesh.points, LANDMARKS, 10)
        np.testing.assert_allclose(values, mesh.points, rtol=0.0, atol=1e-9)

    def test_the_start_is_left_alone(self) -> None:
        start = rough(4)
        kept = start.copy()
        values = fitter_of().fit(start, smooth(LANDMARKS), 3)
        np.testing.assert_array_equal(start, kept)
        assert np.abs(values - start).max() > 1e-3

    def test_a_twist_of_the_inside(self) -> None:
        offsets = icosphere(2, radius=0.25)[0] - 0.5
        fitter = fitter_of(MESH, 0.5 + offsets)
        values = MESH.points
        for angle in np.radians([20.0, 40.0, 60.0, 80.0]):
            turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
            values = fitter.fit(values, 0.5 + offsets @ turn.T, 20)
            assert_a_map_of_the_cube(MESH, values)
        missed = np.linalg.norm(fitter.residuals(values, 0.5 + offsets @ turn.T), axis=1)
        assert np.sqrt((missed**2).mean()) < 0.02


@pytest.mark.parametrize(
    ("file", "first", "second"),
    [
        ("body", "rest", "arm_raise30"),
        ("body", "rest", "t_pose"),
        ("body", "rest", "twist60"),
        ("head", "neutral", "jawOpen"),
    ],
)
def test_real_keys_have_no_folds(data_folder: Path, file: str, first: str, second: str) -> None:
    with np.load(data_folder / f"{file}.npz") as arrays:
        names = arrays["shape_names"].tolist()
        key0, key1 = (arrays[f"V{names.index(name)}"] for name in (first, second))
        pair = KeyPair.checked(key0, key1, arrays["faces"])
    fitted = finish(fit_pair(pair, FitOptions()))
    assert_a_map_of_the_cube(fitted.mesh, fitted.mapped)
    assert fitted.folds(fitted.mapped) == 0
    moved = np.linalg.norm(pair.key1 - pair.key0, axis=1).max() / pair.diagonal
    assert fitted.landmark_residual().rms < 0.05 * moved
