# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices that are locked behind one another are met in smaller tetrahedra, and what is far from them stays."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.fit import local_meeting
from qc3d_addon.solver.fit.local_meeting import Aim, meet_rest
from qc3d_addon.solver.numerics.rotations import determinants
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_addon.solver.tets.point_location import interpolation_matrix

from ..meshes import jittered_grid

MESH = jittered_grid(8, seed=3)


def aim(sources: Floats, targets: Floats, reachable: bool = True) -> Aim:
    count = len(sources)
    return Aim(sources, targets, np.full(count, 1.0 / count), np.full(count, reachable), 1e-4, 1e-3)


def missed(mesh: TetMesh, values: Floats, found: Aim) -> Floats:
    return np.asarray(np.linalg.norm(interpolation_matrix(mesh, found.sources) @ values - found.targets, axis=1))


def two_in_one_tetrahedron() -> tuple[Floats, Floats]:
    """Two points of one tetrahedron that change places, beside two that stay; no linear map does that."""
    middle = MESH.centroids[np.linalg.norm(MESH.centroids - 0.5, axis=1).argmin()]
    apart = 0.02 * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return middle + apart, middle + apart[[1, 0, 2, 3]]


def test_two_points_of_one_tetrahedron_change_places(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local_meeting, "_RINGS", 1)  # the mesh is coarse
    monkeypatch.setattr(local_meeting, "_MORE_RINGS", 1)
    sources, targets = two_in_one_tetrahedron()
    wanted = aim(sources, targets)
    mesh, maps = finish(meet_rest(MESH, np.stack([MESH.points, MESH.points]), wanted))
    assert missed(MESH, MESH.points, wanted).max() > 0.02
    assert missed(mesh, maps[-1], wanted).max() <= 1e-4
    assert determinants(mesh.jacobians(maps[-1])).min() > 0.0
    # The map on the way is the same in the finer mesh, and what is far away has not moved.
    np.testing.assert_allclose(maps[0], mesh.points, atol=1e-6)
    assert len(mesh.tets) > len(MESH.tets)
    far = np.abs(mesh.points - 0.5).max(axis=1) > 0.4
    assert far.sum() > 300
    np.testing.assert_array_equal(maps[-1][far], mesh.points[far])


def test_what_cannot_be_reached_is_tried_in_the_tetrahedra_that_are_there() -> None:
    wanted = aim(*two_in_one_tetrahedron(), reachable=False)
    mesh, maps = finish(meet_rest(MESH, np.stack([MESH.points, MESH.points]), wanted))
    assert len(mesh.tets) == len(MESH.tets)
    assert determinants(mesh.jacobians(maps[-1])).min() > 0.0


def test_where_all_is_met_nothing_is_done() -> None:
    sources = np.random.default_rng(0).uniform(0.2, 0.8, size=(20, 3))
    maps = MESH.points[None]
    mesh, same = finish(meet_rest(MESH, maps, aim(sources, sources)))
    assert mesh is MESH
    assert same is maps
