# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Poisson shape interpolation on the surface.

D. Xu, H. Zhang, Q. Wang, H. Bao: Poisson shape interpolation. SPM 2005.

What is done, in this order:

1. The second key is aligned to the first by the best rigid motion.
2. Each triangle's deformation gradient, with the unit normal as third direction, is split into rotation and stretch;
   the rotation is interpolated by its angle (always the short way round), the stretch linearly.
3. The surface whose gradients are nearest to these, weighted by the first key's areas, solves a Poisson equation.
   Nothing is pinned; each connected part is placed so that its mean vertex lies on the straight path of its means.
4. The share t of the rigid motion is put back.

Triangles without area in the first key carry no weight. Vertices without a triangle follow the straight path.
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
    """Two edges and the unit normal of each triangle as the columns of (m, 3, 3); no area, no normal."""
    a, b, c = positions[faces.T]
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([b - a, c - a, normal / np.where(size > 0.0, size, 1.0)], axis=2)
