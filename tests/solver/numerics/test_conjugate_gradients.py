# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Conjugate gradients against a dense solution."""

from __future__ import annotations

import numpy as np

from qc3d_addon.solver.numerics.conjugate_gradients import conjugate_gradients


def test_against_a_dense_solution() -> None:
    random = np.random.default_rng(3)
    factor = random.normal(size=(30, 30))
    matrix, load = factor @ factor.T + np.diag(10.0 ** random.uniform(0.0, 6.0, 30)), random.normal(size=30)
    inverse = 1.0 / np.diag(matrix)
    found, steps = conjugate_gradients(lambda x: matrix @ x, lambda x: inverse * x, load, 1e-10, (0, 200))
    assert steps < 200
    np.testing.assert_allclose(matrix @ found, load, atol=1e-6)


def test_a_perfect_preconditioner_needs_one_step() -> None:
    diagonal = np.array([1.0, 1e8])
    found, steps = conjugate_gradients(lambda x: diagonal * x, lambda x: x / diagonal, np.ones(2), 1e-8, (0, 50))
    assert steps == 1
    np.testing.assert_allclose(found, 1.0 / diagonal)


def test_nothing_to_do() -> None:
    found, steps = conjugate_gradients(lambda x: x, lambda x: x, np.zeros(4), 1e-3, (0, 50))
    assert steps == 0
    np.testing.assert_array_equal(found, np.zeros(4))


def test_it_ends_by_the_preconditioned_residual() -> None:
    """The first step meets the stiff equation almost; by the plain residual that would be the end."""
    diagonal, load = np.array([1.0, 1e6]), np.array([1.0, 1e5])
    found, _ = conjugate_gradients(lambda x: diagonal * x, lambda x: x / np.array([2.0, 1e6]), load, 1e-3, (0, 50))
    np.testing.assert_allclose(found, load / diagonal, rtol=1e-2)


def test_a_least_number_of_steps() -> None:
    diagonal = np.linspace(1.0, 2.0, 20)
    assert conjugate_gradients(lambda x: diagonal * x, lambda x: x, np.ones(20), 0.9, (4, 50))[1] == 4
