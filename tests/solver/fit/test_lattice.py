# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted maps on a lattice: near what they were, without folds, and as fine as the smallest tetrahedra need."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.fit.continuation import FollowedPath, turns_along
from qc3d_addon.solver.fit.lattice import BITS, mesh_on_lattice, way_on_lattice, whole
from qc3d_addon.solver.numerics.rotations import determinants
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import jittered_grid, sine_map


def test_points_stay_on_the_faces_and_near() -> None:
    mesh = jittered_grid(3, seed=0)
    rounded = mesh_on_lattice(mesh)
    assert whole(rounded.points, BITS[0]) is not None
    np.testing.assert_array_equal(rounded.on_cube_face, mesh.on_cube_face)
    assert 0.0 < np.abs(rounded.points - mesh.points).max() <= 2.0 ** -(BITS[0] + 1)
    np.testing.assert_array_equal(mesh_on_lattice(rounded).points, rounded.points)


@pytest.mark.parametrize(("size", "bits"), [(1e-3, 20), (2e-5, 24), (1e-6, 28), (1e-10, None)])
def test_small_tetrahedra_have_a_finer_lattice(size: float, bits: int | None) -> None:
    corners = 0.3 + size * np.array([[0, 0, 0], [1, 0.2, 0.1], [0.3, 1.1, 0], [0, 0.1, 0.9]]) * np.pi / 3.0
    mesh = TetMesh(corners, np.array([[0, 1, 2, 3]]))
    rounded = mesh_on_lattice(mesh)
    assert next((each for each in BITS if whole(rounded.points, each) is not None), None) == bits
    assert abs(rounded.volumes[0] / mesh.volumes[0] - 1.0) <= 0.01


def test_a_way() -> None:
    mesh = mesh_on_lattice(jittered_grid(3, seed=0))
    full = sine_map(mesh.points, np.full((1, 3), 0.1), np.ones((1, 3, 3)))
    maps = np.stack([mesh.points, 0.5 * (mesh.points + full), full])
    found = way_on_lattice(mesh, FollowedPath(maps, turns_along(mesh, maps)))
    assert whole(found.maps, BITS[0]) is not None
    assert np.abs(found.maps - maps).max() <= 2.0 ** -(BITS[0] + 1)
    assert all(determinants(mesh.jacobians(values)).min() > 0.0 for values in found.maps)
    np.testing.assert_array_equal(found.turns, turns_along(mesh, found.maps))
