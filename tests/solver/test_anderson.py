# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Anderson acceleration: exact on small linear iterations, and never worse off for nothing to learn."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.anderson import AndersonMixing


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_as_many_steps_as_unknowns_solve_a_linear_iteration(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    turn = np.linalg.qr(random.normal(size=(count, count)))[0]
    contraction = turn @ np.diag(np.linspace(-0.9, 0.9, count)) @ turn.T
    fixed = random.normal(size=(1, count))
    mixing, point = AndersonMixing(count, 1.0), random.normal(size=(1, count))
    for _ in range(count + 2):
        mapped = fixed + (point - fixed) @ contraction
        if np.abs(mapped - point).max() < 1e-9:
            break
        point = mixing.next(point, mapped)
    np.testing.assert_allclose(point, fixed, rtol=0.0, atol=1e-4)


def test_the_first_step_goes_as_far_as_it_is_mixed() -> None:
    point, mapped = np.zeros((2, 3)), np.ones((2, 3))
    np.testing.assert_array_equal(AndersonMixing(4, 1.5).next(point, mapped), 1.5 * mapped)


def test_a_fixed_point_stays() -> None:
    mixing, point = AndersonMixing(3, 1.5), np.full((2, 3), 0.4)
    for _ in range(4):
        point = mixing.next(point, point)
    np.testing.assert_array_equal(point, np.full((2, 3), 0.4))
