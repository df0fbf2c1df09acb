# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folds are taken away around them alone."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.fit.energy_density import regularized
from qc3d_addon.solver.fit.unfolding import unfolded_nearby
from qc3d_addon.solver.numerics.rotations import determinants

from ..meshes import jittered_grid


@pytest.mark.parametrize("seed", range(4))
def test_a_vertex_beyond_its_neighbors(seed: int) -> None:
    mesh = jittered_grid(8, seed=seed)
    inside = np.flatnonzero(((mesh.points > 0.3) & (mesh.points < 0.7)).all(axis=1))[5 * seed]
    values = mesh.points.copy()
    values[inside] += 0.2 * np.array([1.0, -0.4, 0.3])
    assert determinants(mesh.jacobians(values)).min() < 0.0
    found = unfolded_nearby(mesh, values)
    assert found is not None
    assert determinants(mesh.jacobians(found)).min() > 0.0
    far = np.linalg.norm(mesh.points - mesh.points[inside], axis=1) > 0.6
    np.testing.assert_array_equal(found[far], values[far])
    np.testing.assert_array_equal(found[mesh.on_cube_face], mesh.points[mesh.on_cube_face])


def test_what_has_no_folds_stays() -> None:
    mesh = jittered_grid(4, seed=1)
    np.testing.assert_array_equal(unfolded_nearby(mesh, mesh.points), mesh.points)


def test_what_cannot_be_unfolded() -> None:
    mesh = jittered_grid(3, seed=1)
    mirrored = mesh.points * np.array([-1.0, 1.0, 1.0])
    assert unfolded_nearby(mesh, mirrored) is None


@pytest.mark.parametrize("width", [1e-3, 0.2])
def test_derivatives_of_the_stand_in(width: float) -> None:
    at = np.linspace(-2.0, 2.0, 41)
    step = 1e-5
    value, first, second = regularized(at, width)
    assert value.min() > 0.0
    after, before = regularized(at + step, width), regularized(at - step, width)
    # Near 0 the third derivative is of the size of 1 / width squared.
    assert np.abs((after[0] - before[0]) / (2 * step) - first).max() < step**2 / width**2 + 1e-9
    assert np.abs((after[1] - before[1]) / (2 * step) - second).max() < step**2 / width**3 + 1e-6
