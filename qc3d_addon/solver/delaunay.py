# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshing engine without compiled dependencies: graded samples of the cube and their Delaunay tetrahedra."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from .sampling import Resolution, sample_cube, sample_surface
from .tetmesh import Floats, Ints, TetMesh, edge_matrices


def delaunay_mesh(points: Floats, faces: Ints, resolution: Resolution, seed: int) -> TetMesh:
    """Fill the cube; repeatable: the same input and seed give the same mesh.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices strictly inside the cube.
    faces : (m, 3) int64
        Triangles, in any state.
    resolution : Resolution
    seed : int
    """
    rng = np.random.default_rng(seed)
    surface = sample_surface(points, faces, resolution.spacing, rng)
    samples = sample_cube(surface, resolution.around(surface), rng)
    return TetMesh(samples, triangulate(samples))


def triangulate(samples: Floats) -> Ints:
    """Delaunay tetrahedra (M, 4) of samples that include the cube's corners, positively oriented, no flat ones."""
    tets = Delaunay(samples).simplices.astype(np.int64)
    negative = np.linalg.det(edge_matrices(samples, tets)) < 0.0
    tets[negative] = tets[negative][:, [0, 1, 3, 2]]
    corners = samples[tets]
    flat = ((corners == corners[:, :1]) & ((corners == 0.0) | (corners == 1.0))).all(axis=1).any(axis=1)
    return tets[~flat]
