# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rates at the ends of a path against finite differences of the path itself."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.numerics.rotation_unwrapping import Turning
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.numerics.symmetric_matrices import Stretch
from qc3d_addon.solver.settings import StretchLaw
from qc3d_addon.solver.surface.end_rates import (
    end_spins,
    hermite,
    rotation_vector_rates,
    slope_of_strain,
    strain_of_slope,
    stretch_slopes,
)

STEP = 1e-5
SEEDS = st.integers(0, 2**32 - 1)


def random_stretch(seed: int) -> Stretch:
    factors = np.random.default_rng(seed).normal(size=(20, 2, 2))
    return Stretch.of(factors @ factors.transpose(0, 2, 1) + 0.2 * np.eye(2))


def spins_between(before: Floats, after: Floats, duration: float) -> Floats:
    """(m, 3) angular velocities from two rotations (m, 3, 3) a short time apart."""
    skew = (after - before) @ (0.5 * (before + after)).transpose(0, 2, 1) / duration
    skew = 0.5 * (skew - skew.transpose(0, 2, 1))
    return np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)


def test_hermite_has_the_slopes_and_moves_no_end() -> None:
    slopes = np.array([2.0]), np.array([-3.0])
    assert hermite(0.0, *slopes) == 0.0
    assert hermite(1.0, *slopes) == 0.0
    assert hermite(STEP, *slopes) / STEP == pytest.approx(2.0, abs=1e-3)
    assert hermite(1.0 - STEP, *slopes) / -STEP == pytest.approx(-3.0, abs=1e-3)


@given(SEEDS)
def test_rotation_vector_rates_spin_as_asked(seed: int) -> None:
    random = np.random.default_rng(seed)
    vectors = random.normal(size=(20, 3))
    vectors *= (random.uniform(0.0, 1.5 * np.pi, 20) / np.linalg.norm(vectors, axis=1))[:, None]
    vectors[0] = 0.0
    spins = random.normal(size=(20, 3))
    rates = rotation_vector_rates(vectors, spins)
    found = spins_between(
        rotation_matrices(vectors - STEP * rates), rotation_matrices(vectors + STEP * rates), 2.0 * STEP
    )
    np.testing.assert_allclose(found, spins, atol=1e-7)


@given(SEEDS)
def test_end_spins_are_those_of_the_turning(seed: int) -> None:
    swing, twist = np.random.default_rng(seed).normal(size=(2, 20, 3))
    turning = Turning(swing, 3.0 * twist)
    first, second = end_spins(turning.swing, turning.twist)
    for time, spins in ((0.0, first), (1.0, second)):
        found = spins_between(turning.at(time - STEP), turning.at(time + STEP), 2.0 * STEP)
        np.testing.assert_allclose(found, spins, atol=1e-6)


@pytest.mark.parametrize("law", get_args(StretchLaw))
def test_stretch_slopes_are_derivatives(law: StretchLaw) -> None:
    stretch = random_stretch(3)
    for time, slope in zip((0.0, 1.0), stretch_slopes(stretch, law), strict=True):
        found = (stretch.at(time + STEP, law) - stretch.at(time - STEP, law)) / (2.0 * STEP)
        np.testing.assert_allclose(found, slope, atol=1e-7)


@given(SEEDS)
def test_slope_and_strain_are_inverse(seed: int) -> None:
    stretch = random_stretch(seed)
    strain = np.random.default_rng(seed).normal(size=(20, 2, 2))
    strain += strain.transpose(0, 2, 1)
    slope = slope_of_strain(stretch, strain)
    np.testing.assert_allclose(slope, slope.transpose(0, 2, 1), atol=1e-9)
    np.testing.assert_allclose(strain_of_slope(stretch, slope), strain, atol=1e-9)
