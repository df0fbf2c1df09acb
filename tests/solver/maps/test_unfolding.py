# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps that rounding has folded come back without folds, and near."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.maps.unfolding import _Place, unfolded
from qc3d_addon.solver.numerics.rotations import determinants
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import jittered_grid, sine_map

MESH = jittered_grid(6, seed=0)
WAVES = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]], [[2, 0, 1], [1, 2, 0], [0, 1, 2]]])
MAP = sine_map(MESH.points, np.array([[0.06, -0.05, 0.05], [-0.03, 0.04, 0.03]]), WAVES)
FREE = ~MESH.on_cube_face


def noisy(size: float, seed: int) -> Floats:
    return np.asarray(MAP + np.random.default_rng(seed).normal(scale=size, size=MAP.shape) * FREE)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.02, 0.03]), st.floats(-3.0, 3.0), st.floats(-1e3, 1e3))
def test_no_folds_are_left_and_known_coordinates_stay(seed: int, size: float, exponent: float, away: float) -> None:
    unit = 10.0**exponent
    values = unit * noisy(size, seed) + away * unit
    found = unfolded(MESH, values, FREE)
    before = Mapping(MESH, values).folds
    assert Mapping(MESH, found).folds == 0
    np.testing.assert_array_equal(found[~FREE], values[~FREE])
    assert np.abs(found - values).max() < (0.3 * unit if before else 1e-300)


def test_what_is_far_from_the_folds_stays() -> None:
    values = MAP.copy()
    values[np.argmin(((MESH.points - 0.5) ** 2).sum(axis=1))] += 0.25
    found = unfolded(MESH, values, FREE)
    assert Mapping(MESH, values).folds > 0
    assert Mapping(MESH, found).folds == 0
    assert np.count_nonzero((found != values).any(axis=1)) < len(values) / 2


def test_what_cannot_be_unfolded_stays() -> None:
    mirrored = MESH.points * [-1.0, 1.0, 1.0]
    np.testing.assert_array_equal(unfolded(MESH, mirrored, np.ones_like(FREE)), mirrored)
    values = MAP.copy()
    values[FREE.any(axis=1)] += 5.0
    np.testing.assert_array_equal(unfolded(MESH, values, np.zeros_like(FREE)), values)


@pytest.mark.parametrize("softness", [1e-3, 0.3])
def test_forces_are_the_slope_of_the_energy(softness: float) -> None:
    values = noisy(0.05, 0)
    place = _Place.around(TetMesh(MESH.points, MESH.tets), values, determinants(MESH.jacobians(values)) <= 0.0, FREE, 2)
    places = place.values.ravel()[place.moving]
    start = places + 0.01
    direction = np.random.default_rng(1).normal(size=places.shape)
    _, forces = place._energy(places, start, softness, 10.0)
    up, down = (place._energy(places + sign * 1e-7 * direction, start, softness, 10.0)[0] for sign in (1.0, -1.0))
    assert (up - down) / 2e-7 == pytest.approx(forces @ direction, rel=2e-3)
