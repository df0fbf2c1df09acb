# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tetrahedra as fine as a surface's edges: with a sample beside every vertex, a map can meet all vertices.

A piecewise linear map can meet the vertices inside its tetrahedra if it has a degree of freedom for each. A sample
beside every vertex ensures this, also where edges are short, as at fingers and lips. Away from the surface the
tetrahedra grow.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from ..tets.mesh import TetMesh
from ..triangles.geometry import areas
from ..triangles.topology import without_piles
from .poisson_disk import RESOLUTIONS, SizeField, sample_cube, thin
from .slivers import Effort, sliver_free

# Spacing of samples at the surface, in local edge lengths: for the map that follows the motion, and for the one that
# meets the keys.
COARSE_SHARE, FINE_SHARE = 2.0, 0.7
_NEAREST = 6  # nearest vertices whose mean distance defines the local edge length
# Much nearer vertices belong to another sheet, across a gap that has to be resolved. Factor on their distance.
_GAP = 1.6
_SLOPE = 0.6  # growth of the distance between samples away from the surface
_APART = 0.6  # vertices nearer than this part of the local distance share a sample, with a share below 1
# Samples lie beside the vertices, by this part of the local distance: the four corners of every quad would make a flat
# tetrahedron otherwise.
_BESIDE = 0.15
_OVERSAMPLING = 4.0
_WIDEST_CELL = 1.0
_EFFORT = Effort(sweeps=2, rounds=6, angle=5.0)


def vertex_mesh(points: Floats, faces: Ints, share: float, seed: int) -> TetMesh:
    """Fill the cube with Delaunay tetrahedra whose size at the surface follows the local length of edges.

    The same input and seed give the same mesh.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices strictly inside the cube.
    faces : (m, 3) int64
        Triangles, in any state; may be empty.
    share : float
        Spacing of samples at the surface, in local edge lengths; below 1 every vertex has a sample.
    seed : int
    """
    rng = np.random.default_rng(seed)
    size = size_around(points, share)
    vertices = rng.permutation(points[without_piles(points, 2)])
    # A coarse mesh has to find its way, for which it must not be finer than it looks.
    apart = _APART if share < 1.0 else 1.0
    vertices = vertices[thin(vertices, apart * size(vertices))]
    surface = np.concatenate([vertices, _between(vertices, points, faces, size, rng)])
    direction = rng.normal(size=surface.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    surface += _BESIDE * size(surface)[:, None] * direction
    samples = sample_cube(surface, size, rng, _WIDEST_CELL)
    return sliver_free(samples, size, rng, _EFFORT, in_place=8 + len(surface))


def size_around(points: Floats, share: float) -> SizeField:
    """The spacing of samples around vertices (n, 3), nowhere larger than with quality ``normal``."""
    normal = RESOLUTIONS["normal"]
    places = np.unique(points, axis=0)
    tree = cKDTree(places)
    distances, neighbours = tree.query(places, k=min(_NEAREST + 1, len(places)))
    distances = np.asarray(distances, dtype=np.float64).reshape(len(places), -1)
    if distances.shape[1] == 1:
        return normal.around(places)
    beside = distances[:, 1:]
    local = share * np.minimum(beside.mean(axis=1), _GAP * beside[:, 0])
    for _ in range(_NEAREST):
        local = np.minimum(local, (local[neighbours] + _SLOPE * distances).min(axis=1))
    coarsest = max(1.0, min(share, 1.5)) * normal.spacing

    def size(positions: Floats) -> Floats:
        far, nearest = (np.asarray(found) for found in tree.query(positions, k=min(4, len(places))))
        graded = (local[nearest] + _SLOPE * far).min(axis=1)
        return np.minimum(np.minimum(graded, coarsest + normal.slope * far[:, 0]), normal.largest, dtype=np.float64)

    return size


def _between(vertices: Floats, points: Floats, faces: Ints, size: SizeField, rng: np.random.Generator) -> Floats:
    """(k, 3) samples on triangles that are large for the local spacing, at a distance from the samples of vertices."""
    sizes = areas(points, faces)
    corners = points[faces]
    expected = _OVERSAMPLING * sizes / size(corners.mean(axis=1)) ** 2 if len(faces) else np.empty(0)
    count = np.floor(expected + rng.random(len(expected))).astype(np.int64)
    triangle = rng.permutation(np.repeat(np.arange(len(faces)), count))
    samples: Floats = np.einsum("nk,nka->na", rng.dirichlet((1.0, 1.0, 1.0), size=len(triangle)), corners[triangle])
    return samples[thin(samples, size(samples), vertices)] if len(samples) else samples
