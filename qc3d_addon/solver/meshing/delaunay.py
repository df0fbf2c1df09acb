# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshing engine ``delaunay``, which needs only scipy: Delaunay tetrahedra of graded samples of the cube."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..settings import FitOptions
from ..tets.mesh import TetMesh
from .poisson_disk import Resolution, sample_cube, sample_surface
from .published_samples import Discarding, sample_cube_as_published
from .slivers import sliver_free


def delaunay_mesh(points: Floats, faces: Ints, resolution: Resolution, options: FitOptions) -> TetMesh:
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
    """
    rng = np.random.default_rng(options.seed)
    surface = sample_surface(points, faces, resolution.spacing, rng)
    if options.sampling == "published":
        discarding = Discarding(resolution.spacing, options.threshold, options.sparsity)
        return sliver_free(sample_cube_as_published(surface, discarding, rng), discarding.around(surface), rng)
    size = resolution.around(surface)
    return sliver_free(sample_cube(surface, size, rng), size, rng)
