# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshing engine ``delaunay``, which needs only scipy: Delaunay tetrahedra of graded samples of the cube."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..settings import FitOptions
from ..tets.mesh import TetMesh
from .motion_sizes import MotionSizes
from .poisson_disk import Resolution, sample_cube, sample_surface
from .published_samples import Discarding, sample_cube_as_published
from .slivers import Effort, sliver_free

# Tetrahedra grow fast away from the surface: more smoothing would only even this out.
_EFFORT = Effort(sweeps=3, rounds=20)


def delaunay_mesh(
    points: Floats, faces: Ints, resolution: Resolution, options: FitOptions, moved: Floats | None = None
) -> TetMesh:
    """Fill the cube. Deterministic: the same input and seed give the same mesh.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices strictly inside the cube.
    faces : (m, 3) int64
        Triangles in any state; may be empty.
    resolution : Resolution
        Target distances between samples.
    options : FitOptions
        Its seed, and which samples are taken.
    moved : (n, 3), optional
        The second key in the same cube: tetrahedra are smaller where the motion asks for it.
    """
    rng = np.random.default_rng(options.seed)
    if options.sampling == "published":
        surface = sample_surface(points, faces, resolution.spacing, rng)
        discarding = Discarding(resolution.spacing, options.threshold, options.sparsity)
        return sliver_free(sample_cube_as_published(surface, discarding, rng), discarding.around(surface), rng)
    size = MotionSizes.of(points, faces, moved, resolution, rng)
    surface = sample_surface(points, faces, size.finest, rng, size)
    return sliver_free(sample_cube(surface, size, rng), size, rng, _EFFORT)
