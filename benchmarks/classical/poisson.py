# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Poisson shape interpolation on the surface.

D. Xu, H. Zhang, Q. Wang, H. Bao: Poisson shape interpolation. SPM 2005.

The steps:

1. Align the second key to the first by the best rigid motion.
2. Split each triangle's deformation gradient, completed by the unit normals, into rotation and stretch. Interpolate the
   rotation by its angle, always the short way round, and the stretch linearly.
3. Solve a Poisson equation for the surface whose gradients are closest to these, weighted by the areas in the first
   key. No vertex is fixed; each component is placed so that its mean moves along a straight line.
4. Put back the fraction t of the rigid motion.

Triangles without area in the first key have no weight. Vertices without a triangle move along straight lines.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .gradients import Floats, GradientPath, Ints, LeastSquares, RigidMotion


def frames(key0: Floats, key1: Floats, faces: Ints, times: ArrayLike) -> Floats:
    """In-betweens (k, n, 3) at the times."""
    motion = RigidMotion.between(key0, key1)
    target = motion.undo(key1)
    bases = frames_of_triangles(key0, faces)
    areas = 0.5 * np.linalg.norm(np.cross(bases[:, :, 0], bases[:, :, 1]), axis=1)
    solid = areas > 1e-12 * areas.max()
    faces, bases, areas = faces[solid], bases[solid], areas[solid]
    inverse = np.linalg.inv(bases)
    path = GradientPath(frames_of_triangles(target, faces) @ inverse)
    hats = np.stack([-inverse[:, 0] - inverse[:, 1], inverse[:, 0], inverse[:, 1]], axis=1)
    system = LeastSquares(len(key0), faces, hats, areas)
    return np.stack(
        [
            motion.apply(system.shape(path.at(time), (1.0 - time) * key0 + time * target), time)
            for time in np.asarray(times, dtype=np.float64)
        ]
    )


def frames_of_triangles(positions: Floats, faces: Ints) -> Floats:
    """(m, 3, 3) two edges and the unit normal of each triangle in columns; the normal is zero without an area."""
    a, b, c = positions[faces.T]
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([b - a, c - a, normal / np.where(size > 0.0, size, 1.0)], axis=2)
