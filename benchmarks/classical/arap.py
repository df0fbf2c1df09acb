# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""As-rigid-as-possible shape interpolation on interior tetrahedra.

M. Alexa, D. Cohen-Or, D. Levin: As-rigid-as-possible shape interpolation. SIGGRAPH 2000.

The steps:

1. Align the second key to the first by the best rigid motion.
2. Fill the first key with tetrahedra whose corners are the surface's vertices and samples of its interior
   (``interior.fill``).
3. The positions of the samples in the second key are unknown. They minimize the as-rigid-as-possible energy for fixed
   surface vertices (O. Sorkine, M. Alexa: As-rigid-as-possible surface modeling. SGP 2007; here on tetrahedra),
   starting from the harmonic solution.
4. Split each tetrahedron's gradient into rotation and stretch. Interpolate the rotation by its angle, always the short
   way round, and the stretch linearly. Solve a Poisson equation for the shape whose gradients are closest to these,
   weighted by the volumes in the first key. No vertex is fixed; each component is placed so that its mean moves along
   a straight line.
5. Put back the fraction t of the rigid motion.

The method is meant for closed surfaces; an open one has no well-defined inside. There, the tetrahedra are those in
which the generalized winding number exceeds one half, and vertices without a tetrahedron move along straight lines.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import interior
from .gradients import Floats, GradientPath, Ints, LeastSquares, RigidMotion, factorized, rotations_nearest

SWEEPS = 40  # local/global iterations for the samples' positions in the second key


def frames(key0: Floats, key1: Floats, faces: Ints, times: ArrayLike) -> tuple[Floats, dict[str, int]]:
    """In-betweens (k, n, 3), and the numbers of tetrahedra, of folded ones in the second key, of loose vertices."""
    motion = RigidMotion.between(key0, key1)
    target = motion.undo(key1)
    points, tetrahedra = interior.fill(key0, faces)
    system = system_of(points, tetrahedra)
    final = place_samples(system, points, target)
    gradients = system.gradients(final)
    path = GradientPath(gradients)
    result = [
        motion.apply(system.shape(path.at(time), (1.0 - time) * points + time * final)[: len(key0)], time)
        for time in np.asarray(times, dtype=np.float64)
    ]
    counts = {
        "tetrahedra": len(tetrahedra),
        "folded": int((np.linalg.det(gradients) <= 0.0).sum()),
        "loose": int(len(key0) - np.isin(np.arange(len(key0)), tetrahedra).sum()),
    }
    return np.stack(result), counts


def system_of(points: Floats, tetrahedra: Ints) -> LeastSquares:
    """The least-squares problem of a tetrahedral mesh, weighted by volume."""
    corners = points[tetrahedra]
    edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    inverse = np.linalg.inv(edges)
    hats = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    return LeastSquares(len(points), tetrahedra, hats, np.abs(np.linalg.det(edges)) / 6.0)


def place_samples(system: LeastSquares, points: Floats, surface: Floats) -> Floats:
    """Points of the second key: the given surface, then the samples where they minimize the energy."""
    held = len(surface)
    if held == len(points):
        return surface
    inner = factorized(system.matrix[held:, held:])
    coupling = system.matrix[held:, :held]
    harmonic = inner.solve(-(coupling @ (surface - points[:held])))
    final = np.concatenate([surface, points[held:] + harmonic])
    for _ in range(SWEEPS):
        rotations = rotations_nearest(system.gradients(final))
        final[held:] = inner.solve(system.divergence(rotations)[held:] - coupling @ surface)
    return np.asarray(final)
