# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Chebyshev iteration: fewer steps on linear iterations, linear in its start, fixed points stay."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.numerics.chebyshev import ChebyshevIteration


def after(steps: int, start: Floats, contraction: Floats, fixed: Floats, radius: float) -> Floats:
    iteration, point = ChebyshevIteration(radius, 1.0), start
    for _ in range(steps):
        point = iteration.next(point, fixed + (point - fixed) @ contraction)
    return point


@given(st.integers(0, 2**32 - 1))
def test_it_depends_linearly_on_the_start(seed: int) -> None:
    random = np.random.default_rng(seed)
    contraction = 0.9 * np.linalg.qr(random.normal(size=(4, 4)))[0]
    first, second, fixed = random.normal(size=(3, 2, 4))
    mixed = after(9, 0.3 * first + 0.7 * second, contraction, fixed, 0.9)
    separate = 0.3 * after(9, first, contraction, fixed, 0.9) + 0.7 * after(9, second, contraction, fixed, 0.9)
    np.testing.assert_allclose(mixed, separate, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("radius", [0.8, 0.95])
def test_errors_shrink_faster_than_by_the_iteration_alone(radius: float) -> None:
    contraction = np.diag(np.linspace(-radius, radius, 9))
    start, fixed = np.ones((1, 9)), np.zeros((1, 9))
    alone = np.abs(after(40, start, contraction, fixed, 0.0)).max()
    assert alone == pytest.approx(radius**40, rel=1e-9)
    assert np.abs(after(40, start, contraction, fixed, radius)).max() < 0.05 * alone


def test_a_fixed_point_stays() -> None:
    iteration, point = ChebyshevIteration(0.95, 1.3), np.full((2, 3), 0.4)
    for _ in range(6):
        point = iteration.next(point, point)
    np.testing.assert_array_equal(point, np.full((2, 3), 0.4))
