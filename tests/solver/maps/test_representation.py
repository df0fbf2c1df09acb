# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The representation: J = R P, its two six-number forms and back, and the matrices A."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.errors import ReconstructionError
from qc3d_addon.solver.maps.representation import (
    conductivity,
    eigen_form,
    from_eigen_form,
    from_upper_triangle,
    polar_decomposition,
    upper_triangle,
)

EXACT = 1e-13
angles = st.floats(-np.pi, np.pi)
sizes = st.floats(0.05, 20.0)


def euler(alpha: float, beta: float, gamma: float) -> Floats:
    """Rz(alpha) Ry(beta) Rx(gamma), from scipy."""
    return np.asarray(Rotation.from_euler("ZYX", [alpha, beta, gamma]).as_matrix())


def stretches(count: int, seed: int = 0) -> Floats:
    """Symmetric positive definite matrices with eigenvalues from 0.05 to 20."""
    vectors = Rotation.random(count, random_state=seed).as_matrix()
    values = np.exp(np.random.default_rng(seed).uniform(-3.0, 3.0, (count, 3)))
    return np.asarray((vectors * values[:, None]) @ vectors.transpose(0, 2, 1))


def assert_survives_eigen_form(stretch: Floats) -> None:
    numbers = eigen_form(stretch)
    assert (np.diff(numbers[:, :3], axis=1) <= 0.0).all()
    assert (np.abs(numbers[:, [3, 5]]) <= np.pi).all()
    assert (np.abs(numbers[:, 4]) <= 0.5 * np.pi).all()
    largest = np.abs(numbers[:, 0]).max()
    np.testing.assert_allclose(from_eigen_form(numbers), stretch, rtol=0.0, atol=EXACT * largest)


class TestPolarDecomposition:
    def test_rotation_times_stretch(self) -> None:
        expected = stretches(100)
        turned = Rotation.random(100, random_state=1).as_matrix()
        rotation, stretch = polar_decomposition(turned @ expected)
        np.testing.assert_allclose(rotation, turned, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(stretch, expected, rtol=0.0, atol=1e-12)
        np.testing.assert_array_equal(stretch, stretch.transpose(0, 2, 1))

    def test_stretch_squared_is_the_metric(self) -> None:
        jacobians = np.eye(3) + 0.3 * np.random.default_rng(2).normal(size=(200, 3, 3))
        stretch = polar_decomposition(jacobians).stretch
        np.testing.assert_allclose(stretch @ stretch, jacobians.transpose(0, 2, 1) @ jacobians, rtol=0.0, atol=1e-12)

    def test_folds_show_in_the_smallest_eigenvalue_alone(self) -> None:
        folded = Rotation.random(20, random_state=3).as_matrix() @ np.diag([3.0, 2.0, -0.5])
        rotation, stretch = polar_decomposition(folded)
        np.testing.assert_allclose(np.linalg.det(rotation), 1.0, rtol=0.0, atol=EXACT)
        expected = np.tile([-0.5, 2.0, 3.0], (20, 1))
        np.testing.assert_allclose(np.linalg.eigvalsh(stretch), expected, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(rotation @ stretch, folded, rtol=0.0, atol=1e-12)


class TestUpperTriangle:
    def test_order(self) -> None:
        stretch = np.array([[[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]]])
        np.testing.assert_array_equal(upper_triangle(stretch), [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]])

    def test_both_directions_bit_for_bit(self) -> None:
        stretch = polar_decomposition(stretches(50)).stretch
        np.testing.assert_array_equal(from_upper_triangle(upper_triangle(stretch)), stretch)
        numbers = np.random.default_rng(0).normal(size=(50, 6))
        np.testing.assert_array_equal(upper_triangle(from_upper_triangle(numbers)), numbers)


class TestEigenForm:
    def test_matrices_come_back(self) -> None:
        assert_survives_eigen_form(stretches(500))

    @pytest.mark.parametrize(
        "values", [(1.0, 1.0, 1.0), (2.0, 2.0, 1.0), (2.0, 1.0, 1.0), (2.0, 2.0 - 1e-15, 1.0), (2.0, 1.0 + 1e-9, 1.0)]
    )
    def test_repeated_eigenvalues(self, values: tuple[float, float, float]) -> None:
        vectors = np.concatenate([np.eye(3)[None], Rotation.random(50, random_state=5).as_matrix()])
        stretch = (vectors * np.array(values)) @ vectors.transpose(0, 2, 1)
        assert_survives_eigen_form(0.5 * (stretch + stretch.transpose(0, 2, 1)))

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    @pytest.mark.parametrize("distance", [0.0, 1e-16, 1e-13, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4])
    def test_gimbal_lock_and_its_neighborhood(self, distance: float, sign: float) -> None:
        rest = np.random.default_rng(6).uniform(-np.pi, np.pi, (20, 2))
        vectors = np.array([euler(alpha, sign * (0.5 * np.pi - distance), gamma) for alpha, gamma in rest])
        stretch = (vectors * np.array([3.0, 2.0, 1.0])) @ vectors.transpose(0, 2, 1)
        assert_survives_eigen_form(0.5 * (stretch + stretch.transpose(0, 2, 1)))

    def test_axes_in_every_order(self) -> None:
        values = np.array([[3, 2, 1], [3, 1, 2], [2, 3, 1], [2, 1, 3], [1, 3, 2], [1, 2, 3]], dtype=float)
        assert_survives_eigen_form(values[:, None] * np.eye(3))

    @given(st.tuples(sizes, sizes, sizes), angles, st.floats(-0.5 * np.pi, 0.5 * np.pi), angles)
    def test_numbers_describe_the_matrix(
        self, values: tuple[float, float, float], alpha: float, beta: float, gamma: float
    ) -> None:
        vectors = euler(alpha, beta, gamma)
        stretch = from_eigen_form(np.array([[*values, alpha, beta, gamma]]))
        np.testing.assert_allclose(stretch[0], (vectors * np.array(values)) @ vectors.T, rtol=0.0, atol=1e-12)
        assert_survives_eigen_form(0.5 * (stretch + stretch.transpose(0, 2, 1)))

    def test_one_form_to_the_other_and_back(self) -> None:
        triangle = upper_triangle(polar_decomposition(stretches(100)).stretch)
        there = eigen_form(from_upper_triangle(triangle))
        np.testing.assert_allclose(upper_triangle(from_eigen_form(there)), triangle, rtol=0.0, atol=1e-11)
        again = eigen_form(from_eigen_form(there))
        np.testing.assert_allclose(again[:, :3], there[:, :3], rtol=0.0, atol=1e-11)

    def test_eigenvectors_are_a_rotation_times_signs(self) -> None:
        stretch = stretches(100)
        numbers = eigen_form(stretch)
        for matrix, (value, *_, alpha, beta, gamma) in zip(stretch, numbers, strict=True):
            first = euler(alpha, beta, gamma)[:, 0]
            np.testing.assert_allclose(matrix @ first, value * first, rtol=0.0, atol=1e-11)


class TestConductivity:
    def test_determinant_over_square(self) -> None:
        stretch = stretches(200)
        expected = np.linalg.det(stretch)[:, None, None] * np.linalg.inv(stretch @ stretch)
        np.testing.assert_allclose(conductivity(stretch), expected, rtol=1e-9, atol=1e-9)

    def test_diagonal(self) -> None:
        np.testing.assert_allclose(
            conductivity(np.diag([2.0, 3.0, 5.0])[None])[0], np.diag([30.0 / 4.0, 30.0 / 9.0, 30.0 / 25.0]), rtol=1e-14
        )

    def test_gradients_become_cross_products(self) -> None:
        jacobians = Rotation.random(100, random_state=7).as_matrix() @ stretches(100)
        flux = conductivity(polar_decomposition(jacobians).stretch) @ jacobians.transpose(0, 2, 1)
        u, v, w = jacobians.transpose(1, 0, 2)
        for column, (second, third) in enumerate([(v, w), (w, u), (u, v)]):
            np.testing.assert_allclose(flux[:, :, column], np.cross(second, third), rtol=1e-8, atol=1e-8)

    @pytest.mark.parametrize(
        "values", [(1.0, 1.0, -1.0), (1.0, -1.0, -1.0), (-1.0, -1.0, -1.0), (1.0, 1.0, 0.0), (1.0, 1.0, np.nan)]
    )
    def test_what_is_not_positive_definite_is_refused(self, values: tuple[float, float, float]) -> None:
        stretch = np.tile(np.eye(3), (5, 1, 1))
        stretch[3] = np.diag(values)
        with pytest.raises(ReconstructionError, match="1 tetrahedra, first number 3"):
            conductivity(stretch)

    @given(st.tuples(*[st.floats(-5.0, 5.0)] * 3), angles, angles, angles)
    def test_refused_exactly_where_an_eigenvalue_is_not_positive(
        self, values: tuple[float, float, float], alpha: float, beta: float, gamma: float
    ) -> None:
        vectors = euler(alpha, beta, gamma)
        stretch = ((vectors * np.array(values)) @ vectors.T)[None]
        if min(values) > 1e-6:
            conductivity(stretch)
        elif min(values) < -1e-6 and min(abs(value) for value in values) > 1e-6:
            with pytest.raises(ReconstructionError):
                conductivity(stretch)
