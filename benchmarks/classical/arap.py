# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""As-rigid-as-possible shape interpolation on interior tetrahedra.

M. Alexa, D. Cohen-Or, D. Levin: As-rigid-as-possible shape interpolation. SIGGRAPH 2000.

What is done, in this order:

1. The second key is aligned to the first by the best rigid motion.
2. The first key is filled with tetrahedra whose corners are all the surface's vertices and samples of the interior
   (``interior.fill``).
3. The samples' places in the second key, which the surface does not tell, minimise the as-rigid-as-possible energy
   with the surface held (O. Sorkine, M. Alexa: As-rigid-as-possible surface modeling. SGP 2007; here on tetrahedra),
   starting from the harmonic one.
4. Each tetrahedron's gradient is split into rotation and stretch; the rotation is interpolated by its angle (always the
   short way round), the stretch linearly; the shape with the nearest gradients, weighted by the first key's
   volumes, solves a Poisson equation. Nothing is pinned; each connected part is placed so that its mean lies on the
   straight path of its means.
5. The share t of the rigid motion is put back.

The method is made for closed surfaces. An open one has no certain inside: the tetrahedra there are those in which the
generalised winding number exceeds one half, and vertices that belong to none follow the straight path.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import interior
from .gradients import Floats, GradientPath, Ints, LeastSquares, RigidMotion, factorised, rotations_nearest

SWEEPS = 40  # of the search for the samples' places in the second key


def frames(key0: Floats, key1: Floats, faces: Ints, times: ArrayLike) -> tuple[Floats, dict[str, int]]:
    """In-betweens (k, n, 3), and how many tetrahedra, folded ones in the second key and loose vertices there are."""
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
    """Points of the second key: the given surface first, then the samples where the interior is most rigid."""
    held = len(surface)
    if held == len(points):
        return surface
    inner = factorised(system.matrix[held:, held:])
    coupling = system.matrix[held:, :held]
    harmonic = inner.solve(-(coupling @ (surface - points[:held])))
    final = np.concatenate([surface, points[held:] + harmonic])
    for _ in range(SWEEPS):
        rotations = rotations_nearest(system.gradients(final))
        final[held:] = inner.solve(system.divergence(rotations)[held:] - coupling @ surface)
    return np.asarray(final)
