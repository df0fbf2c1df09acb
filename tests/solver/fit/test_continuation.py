# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Large motions in small steps: no folds along the way, and turns beyond half a turn are followed."""

from __future__ import annotations

import numpy as np

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.fit.continuation import FollowedPath, follow_path, path_to
from qc3d_addon.solver.fit.fold_free import FoldFreeFitter
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.maps.representation import polar_decomposition
from qc3d_addon.solver.numerics.rotations import determinants, rotation_matrices
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.surface.path import SurfacePath
from qc3d_addon.solver.tets.point_location import interpolation_matrix

from ..meshes import box_surface, jittered_grid, twisted

BAR, FACES = box_surface((3, 3, 9), (1.0, 1.0, 3.0))


def followed(key1: Floats) -> tuple[Embedding, FoldFreeFitter, FollowedPath, list[float]]:
    embedding = Embedding.of(KeyPair.checked(BAR, key1, FACES))
    mesh = jittered_grid(8, seed=1)
    fitter = FoldFreeFitter(mesh, interpolation_matrix(mesh, embedding.key0), embedding.weights)
    path = SurfacePath(embedding)
    done: list[float] = []
    return embedding, fitter, finish(follow_path(fitter, path_to(path, embedding.key1)), done.append), done


def test_a_bar_twisted_by_more_than_half_a_turn() -> None:
    angle = np.radians(220.0)
    embedding, fitter, path, done = followed(twisted(BAR, angle))
    mesh = fitter.mesh
    # About 20 degrees a step; some of the turn is taken out of the whole.
    assert 6 <= len(done) <= 12
    assert done == sorted(done)
    assert done[0] >= 0.0
    assert done[-1] <= 1.0
    assert len(path.maps) == len(done) + 1
    np.testing.assert_array_equal(path.maps[0], mesh.points)
    for values in path.maps:
        assert determinants(mesh.jacobians(values)).min() > 0.0
        np.testing.assert_array_equal(values[mesh.on_cube_face], mesh.points[mesh.on_cube_face])
    missed = np.linalg.norm(fitter.residuals(path.maps[-1], embedding.key1), axis=1)
    assert np.sqrt(embedding.weights @ missed**2) < 0.01
    rotations = polar_decomposition(mesh.jacobians(path.maps[-1])).rotation
    np.testing.assert_allclose(rotation_matrices(path.turns), rotations, rtol=0.0, atol=1e-12)
    # Inside the bar, near its twisted end, the tetrahedra know that they have turned the long way.
    offsets = (mesh.centroids - 0.5) / embedding.scale @ embedding.axes
    top = (np.abs(offsets[:, :2]).max(axis=1) < 0.45) & (offsets[:, 2] > 0.8) & (offsets[:, 2] < 1.5)
    assert top.sum() >= 5
    turns = (path.turns[top] + embedding.motion.turn) @ embedding.axes[:, 2]
    assert np.median(turns) > np.radians(180.0)
    assert turns.min() > np.radians(90.0)


def test_a_small_motion_takes_one_step() -> None:
    _, fitter, path, done = followed(BAR * [1.0, 1.0, 1.1])
    assert len(path.maps) == 2
    assert len(done) == 1
    assert np.abs(path.turns).max() < 0.5
    assert determinants(fitter.mesh.jacobians(path.maps[-1])).min() > 0.0
