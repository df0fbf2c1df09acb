# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folds covered by another map: none is left, nothing far away moves, and failure is reported."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.fit.fold_repair import covered
from qc3d_addon.solver.numerics.rotations import determinants

from ..meshes import jittered_grid

MESH = jittered_grid(9, seed=4)
SMOOTH = MESH.points + 0.01 * np.sin(np.pi * MESH.points)[:, [1, 2, 0]] * ~MESH.on_cube_face


@pytest.mark.parametrize("seed", range(5))
def test_a_vertex_pushed_through_its_neighbors(seed: int) -> None:
    inner = np.flatnonzero(~MESH.on_cube_face.any(axis=1))
    vertex = np.random.default_rng(seed).choice(inner)
    folded = SMOOTH.copy()
    folded[vertex] += 0.3 * (0.5 - folded[vertex]) / np.linalg.norm(0.5 - folded[vertex])
    assert determinants(MESH.jacobians(folded)).min() < 0.0
    found = covered(MESH, folded, SMOOTH)
    assert found is not None
    assert determinants(MESH.jacobians(found)).min() > 0.0
    far = np.linalg.norm(MESH.points - MESH.points[vertex], axis=1) > 0.75
    assert far.any()
    np.testing.assert_array_equal(found[far], folded[far])


def test_a_map_without_folds_stays_as_it_is() -> None:
    np.testing.assert_array_equal(covered(MESH, SMOOTH, MESH.points), SMOOTH)


def test_folds_in_both_maps_cannot_be_covered() -> None:
    flipped = MESH.points[:, [1, 0, 2]]
    assert covered(MESH, flipped, flipped) is None
