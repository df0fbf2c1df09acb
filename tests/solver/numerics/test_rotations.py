# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations against the singular value decomposition, scipy's rotations and their own inverses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.numerics.rotations import (
    closest_rotations,
    cofactors,
    determinants,
    nearest_branch,
    rotation_matrices,
    rotation_vectors,
)

EXACT = 1e-13


def random_rotations(count: int, seed: int = 0) -> Floats:
    return np.asarray(Rotation.random(count, random_state=seed).as_matrix())


def closest_by_svd(matrix: Floats) -> Floats:
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)


def assert_rotations(matrices: Floats) -> None:
    squares = matrices @ matrices.transpose(0, 2, 1)
    np.testing.assert_allclose(squares, np.broadcast_to(np.eye(3), squares.shape), rtol=0.0, atol=EXACT)
    np.testing.assert_allclose(np.linalg.det(matrices), 1.0, rtol=0.0, atol=EXACT)


axes = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda axis: np.linalg.norm(axis) > 1e-3)
units = axes.map(lambda axis: axis / np.linalg.norm(axis))


class TestDeterminantsAndCofactors:
    def test_against_lapack(self) -> None:
        matrices = np.random.default_rng(1).normal(size=(50, 3, 3))
        determinant = np.linalg.det(matrices)
        np.testing.assert_allclose(determinants(matrices), determinant, rtol=1e-12, atol=1e-14)
        inverse = np.linalg.inv(matrices).transpose(0, 2, 1)
        np.testing.assert_allclose(cofactors(matrices), determinant[:, None, None] * inverse, rtol=1e-9, atol=1e-12)

    def test_cofactors_of_singular_matrices_are_the_gradient_of_the_determinant(self) -> None:
        matrix = np.outer([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])[None]
        matrix[0, 0, 0] += 1.0
        assert np.linalg.matrix_rank(matrix[0]) == 2
        gradient = np.empty((3, 3))
        for place in np.ndindex(3, 3):
            # The determinant is linear in every entry, so a difference of any length is exact.
            moved = matrix.copy()
            moved[0][place] += 1.0
            gradient[place] = determinants(moved)[0] - determinants(matrix)[0]
        np.testing.assert_allclose(cofactors(matrix)[0], gradient, rtol=0.0, atol=1e-12)


class TestClosestRotations:
    @pytest.mark.parametrize("sizes", [(3.0, 2.0, 1.0), (1.0, 1.0, 1.0), (5.0, 5.0, 0.1), (1e3, 1.0, 1e-2)])
    def test_against_svd(self, sizes: tuple[float, float, float]) -> None:
        matrices = random_rotations(40, 1) @ np.diag(sizes) @ random_rotations(40, 2)
        found = closest_rotations(matrices)
        expected = np.array([closest_by_svd(matrix) for matrix in matrices])
        assert_rotations(found)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)

    def test_reflections(self) -> None:
        matrices = random_rotations(40, 1) @ np.diag([3.0, 2.0, -1.0]) @ random_rotations(40, 2)
        found = closest_rotations(matrices)
        assert_rotations(found)
        np.testing.assert_allclose(found, [closest_by_svd(matrix) for matrix in matrices], rtol=0.0, atol=1e-12)

    def test_rank_two_is_unique(self) -> None:
        left, right = random_rotations(40, 1), random_rotations(40, 2)
        found = closest_rotations(left @ np.diag([3.0, 2.0, 0.0]) @ right)
        assert_rotations(found)
        np.testing.assert_allclose(found, left @ right, rtol=0.0, atol=1e-12)

    @pytest.mark.parametrize("sizes", [(1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 1.0, -1.0), (-1.0, -1.0, -1.0)])
    def test_where_it_is_not_unique_none_is_closer(self, sizes: tuple[float, float, float]) -> None:
        left, right = random_rotations(10, 1), random_rotations(10, 2)
        found = closest_rotations(left @ np.diag(sizes) @ right)
        assert_rotations(found)
        ordered = np.sort(np.abs(sizes))[::-1]
        best = ordered[0] + ordered[1] + np.sign(np.prod(sizes)) * ordered[2]
        overlap = np.einsum("kij,kij->k", found, left @ np.diag(sizes) @ right)
        np.testing.assert_allclose(overlap, best, rtol=0.0, atol=1e-12)

    @pytest.mark.parametrize("scale", [1e-250, 1e-100, 1e-8, 1e8, 1e100])
    def test_scale_does_not_matter(self, scale: float) -> None:
        matrices = random_rotations(20, 1) @ np.diag([3.0, 2.0, 1.0]) @ random_rotations(20, 2)
        found = closest_rotations(scale * matrices)
        np.testing.assert_allclose(found, closest_rotations(matrices), rtol=0.0, atol=EXACT)

    def test_nothing_in_nothing_out(self) -> None:
        assert closest_rotations(np.empty((0, 3, 3))).shape == (0, 3, 3)

    @given(st.lists(st.floats(-10.0, 10.0), min_size=9, max_size=9))
    def test_no_rotation_is_closer(self, entries: list[float]) -> None:
        matrix = np.array(entries).reshape(1, 3, 3)
        found = closest_rotations(matrix)
        assert_rotations(found)
        best = float((closest_by_svd(matrix[0]) * matrix[0]).sum())
        assert float((found * matrix).sum()) == pytest.approx(best, abs=1e-10)


class TestRotationVectors:
    def test_against_scipy(self) -> None:
        rotations = Rotation.random(200, random_state=3)
        found = rotation_vectors(rotations.as_matrix())
        np.testing.assert_allclose(found, rotations.as_rotvec(), rtol=0.0, atol=EXACT)
        vectors = np.random.default_rng(4).normal(scale=5.0, size=(200, 3))
        expected = Rotation.from_rotvec(vectors).as_matrix()
        np.testing.assert_allclose(rotation_matrices(vectors), expected, rtol=0.0, atol=EXACT)

    @pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-16, 1e-9, 1e-5, 0.99e-4, 1.01e-4, 1e-3, 1.0, 3.0])
    def test_round_trip(self, angle: float) -> None:
        vectors = angle * random_rotations(50)[:, 0]
        matrices = rotation_matrices(vectors)
        assert_rotations(matrices)
        np.testing.assert_allclose(rotation_vectors(matrices), vectors, rtol=1e-12, atol=3e-16)

    @pytest.mark.parametrize("below", [1e-2, 1e-3])
    def test_round_trip_just_below_half_a_turn(self, below: float) -> None:
        vectors = (np.pi - below) * random_rotations(50)[:, 0]
        np.testing.assert_allclose(rotation_vectors(rotation_matrices(vectors)), vectors, rtol=0.0, atol=1e-14)

    @pytest.mark.parametrize("beside", [1e-7, 1e-10, 1e-13, 0.0, -1e-13, -1e-7])
    def test_half_a_turn_always_goes_the_same_way(self, beside: float) -> None:
        axes = random_rotations(50)[:, 0]
        matrices = rotation_matrices((np.pi - beside) * axes)
        found = rotation_vectors(matrices)
        np.testing.assert_allclose(found, rotation_vectors(rotation_matrices((np.pi + beside) * axes)), atol=1e-6)
        np.testing.assert_allclose(rotation_matrices(found), matrices, rtol=0.0, atol=EXACT)

    def test_half_a_turn_may_come_back_the_other_way_round(self) -> None:
        vectors = np.pi * np.concatenate([np.eye(3), -np.eye(3), random_rotations(50)[:, 0]])
        found = rotation_vectors(rotation_matrices(vectors))
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), np.pi, rtol=0.0, atol=EXACT)
        np.testing.assert_allclose(np.abs(np.einsum("ki,ki->k", found, vectors)), np.pi**2, rtol=0.0, atol=1e-12)

    def test_exact_half_turns(self) -> None:
        halves = np.array([np.diag(signs) for signs in ([1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])])
        np.testing.assert_array_equal(np.abs(rotation_vectors(halves)), np.pi * np.eye(3))

    def test_the_identity_has_no_rotation(self) -> None:
        np.testing.assert_array_equal(rotation_vectors(np.eye(3)[None]), np.zeros((1, 3)))
        np.testing.assert_array_equal(rotation_matrices(np.zeros((1, 3))), np.eye(3)[None])

    # Closer to a half turn, one of its two axes is chosen whatever the rounding.
    @given(units, st.floats(0.0, np.pi - 1e-3))
    def test_round_trip_of_anything(self, axis: Floats, angle: float) -> None:
        vector = angle * axis[None]
        np.testing.assert_allclose(rotation_vectors(rotation_matrices(vector)), vector, atol=1e-14, rtol=1e-13)

    @given(units, st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
    def test_turns_about_one_axis_add_up(self, axis: Floats, first: float, second: float) -> None:
        product = rotation_matrices(first * axis[None]) @ rotation_matrices(second * axis[None])
        np.testing.assert_allclose(rotation_matrices((first + second) * axis[None]), product, rtol=0.0, atol=1e-12)


class TestNearestBranch:
    @given(units, st.floats(1e-6, np.pi), st.integers(-3, 3))
    def test_full_turns_come_back(self, axis: Floats, angle: float, turns: int) -> None:
        wanted = (angle + 2.0 * np.pi * turns) * axis[None]
        np.testing.assert_allclose(nearest_branch(angle * axis[None], wanted), wanted, rtol=0.0, atol=1e-12)

    @given(units, st.floats(0.0, np.pi), units, st.floats(0.0, 20.0))
    def test_same_rotation_and_no_branch_is_nearer(
        self, axis: Floats, angle: float, other: Floats, length: float
    ) -> None:
        vector, reference = angle * axis[None], length * other[None]
        found = nearest_branch(vector, reference)
        np.testing.assert_allclose(rotation_matrices(found), rotation_matrices(vector), rtol=0.0, atol=1e-12)
        branches = (angle + 2.0 * np.pi * np.arange(-6, 7))[:, None] * axis
        if angle > 1e-9:
            nearest = np.linalg.norm(branches - reference, axis=1).min()
            assert np.linalg.norm(found - reference) <= nearest + 1e-9

    def test_the_identity_takes_the_axis_of_its_reference(self) -> None:
        reference = np.array([[0.0, 0.0, 6.0], [0.0, 0.0, 0.0], [0.0, 0.0, 3.0], [-12.0, 0.0, 0.0]])
        expected = 2.0 * np.pi * np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [-2.0, 0.0, 0.0]])
        np.testing.assert_allclose(nearest_branch(np.zeros((4, 3)), reference), expected, rtol=0.0, atol=1e-15)

    def test_a_growing_turn_is_followed_through_many_revolutions(self) -> None:
        axis = np.array([1.0, 2.0, -2.0]) / 3.0
        followed = np.zeros((1, 3))
        for angle in np.linspace(0.0, 20.0, 60):
            followed = nearest_branch(rotation_vectors(rotation_matrices(angle * axis[None])), followed)
            np.testing.assert_allclose(followed, angle * axis[None], rtol=0.0, atol=1e-12)
