# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps that are fitted to landmarks with large weights."""

from __future__ import annotations

import numpy as np

from qc3d_addon.solver.fit.fold_free import FoldFreeFitter
from qc3d_addon.solver.fit.stiff_landmarks import StiffFitter
from qc3d_addon.solver.meshing.vertex_mesh import vertex_mesh
from qc3d_addon.solver.numerics.rotations import determinants
from qc3d_addon.solver.tets.point_location import interpolation_matrix

from ..meshes import icosphere


def test_a_small_part_that_moves_far_carries_what_is_beside_it() -> None:
    points, faces = icosphere(2, 0.04)
    moved = points + np.array([0.1, 0.0, 0.0])
    mesh = vertex_mesh(points, faces, seed=0)
    landmarks, weights = interpolation_matrix(mesh, points), np.full(len(points), 100.0 / len(points))
    stiff, by_volume = StiffFitter(mesh, landmarks, weights), FoldFreeFitter(mesh, landmarks, weights)
    values = stiff.fit(mesh.points, moved, 30)
    assert np.abs(stiff.residuals(values, moved)).max() < 1e-5
    # More than its diameter, and nothing is squashed.
    assert determinants(mesh.jacobians(values)).min() > 0.5
    # With volumes as weights, a few small tetrahedra hold up all others.
    held_up = by_volume.fit(mesh.points, moved, 30)
    assert np.abs(by_volume.residuals(held_up, moved)).max() > 0.01
