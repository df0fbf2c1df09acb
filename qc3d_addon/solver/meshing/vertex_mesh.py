# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tetrahedra as fine as a surface's edges: with a sample beside every vertex, a map can meet all vertices.

A piecewise linear map can meet the vertices inside its tetrahedra if it has a degree of freedom for each. A sample
beside every vertex ensures this, also where edges are short, as at fingers and lips. Where the map stretches the
surface it needs more of them, to follow the surface between its vertices. Away from the surface the tetrahedra grow.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from ..tets.mesh import TetMesh
from ..triangles.geometry import areas
from ..triangles.topology import sides, without_piles
from .poisson_disk import RESOLUTIONS, SizeField, sample_cube, thin
from .slivers import Effort, sliver_free

_SHARE = 0.5  # spacing of samples at the surface, in local edge lengths; below 1 every vertex has a sample
_MOST_FINER = 3.0  # where the surface is stretched, the spacing is divided by the root of its stretch, and at most this
# Spacing at the surface where edges are long, cube units: of surfaces with many vertices, and of those with few. With
# no more tetrahedra than these have vertices, a map would have to bend from vertex to vertex to meet them all.
_WIDEST, _MANY, _WIDEST_OF_FEW = 0.02, 4_000, 0.014
_NEAREST = 6  # nearest vertices whose mean distance defines the local edge length
# Much nearer vertices belong to another sheet, across a gap that has to be resolved. Factor on their distance.
_GAP = 1.6
_SLOPE = 0.6  # growth of the distance between samples away from the surface
_APART = 0.6  # vertices nearer than this part of the local distance share a sample
# Samples lie beside the vertices, by this part of the local distance: the four corners of every quad would make a flat
# tetrahedron otherwise.
_BESIDE = 0.15
_LEAST_EDGE = 1e-6  # cube units: shorter edges have no stretch that can be told
_OVERSAMPLING = 4.0
_WIDEST_CELL = 1.0
_EFFORT = Effort(sweeps=2, rounds=6, angle=5.0)


def vertex_mesh(points: Floats, faces: Ints, seed: int, moved: Floats | None = None) -> TetMesh:
    """Fill the cube with Delaunay tetrahedra whose size at the surface follows the local length of edges.

    The same input and seed give the same mesh.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices strictly inside the cube.
    faces : (m, 3) int64
        Triangles, in any state; may be empty.
    seed : int
    moved : (n, 3), optional
        The vertices of the second key, in the same cube: where edges become longer, tetrahedra are smaller.
    """
    rng = np.random.default_rng(seed)
    size = size_around(points, np.ones(len(points)) if moved is None else _stretches(points, moved, faces))
    vertices = rng.permutation(points[without_piles(points, 2)])
    vertices = vertices[thin(vertices, _APART * size(vertices))]
    surface = np.concatenate([vertices, _between(vertices, points, faces, size, rng)])
    direction = rng.normal(size=surface.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    surface += _BESIDE * size(surface)[:, None] * direction
    samples = sample_cube(surface, size, rng, _WIDEST_CELL)
    return sliver_free(samples, size, rng, _EFFORT, in_place=8 + len(surface))


def size_around(points: Floats, stretches: Floats) -> SizeField:
    """The spacing of samples around vertices (n, 3) with stretches (n,); at the surface at most 0.02, 0.014 for few."""
    normal = RESOLUTIONS["normal"]
    places, place = np.unique(points, axis=0, return_inverse=True)
    tree = cKDTree(places)
    distances, neighbors = tree.query(places, k=min(_NEAREST + 1, len(places)))
    distances = np.asarray(distances, dtype=np.float64).reshape(len(places), -1)
    if distances.shape[1] == 1:
        return normal.around(places)
    finer = np.ones(len(places))
    np.maximum.at(finer, place.ravel(), np.sqrt(np.clip(stretches, 1.0, _MOST_FINER**2)))
    beside = distances[:, 1:]
    local = _SHARE / finer * np.minimum(beside.mean(axis=1), _GAP * beside[:, 0])
    widest = min(_WIDEST, max(_WIDEST_OF_FEW, _WIDEST * (len(places) / _MANY) ** (1.0 / 3.0)))
    for _ in range(_NEAREST):
        local = np.minimum(local, (local[neighbors] + _SLOPE * distances).min(axis=1))

    def size(positions: Floats) -> Floats:
        far, nearest = (np.asarray(found) for found in tree.query(positions, k=min(4, len(places))))
        graded = (local[nearest] + _SLOPE * far).min(axis=1)
        coarsest = np.minimum(widest + normal.slope * far[:, 0], normal.largest)
        return np.asarray(np.minimum(graded, coarsest), dtype=np.float64)

    return size


def _stretches(points: Floats, moved: Floats, faces: Ints) -> Floats:
    """(n,) how many times longer the edges at each vertex become: the largest ratio."""
    edges = sides(faces)
    before, after = (np.linalg.norm(shape[edges[:, 1]] - shape[edges[:, 0]], axis=1) for shape in (points, moved))
    ratios = after / np.maximum(before, _LEAST_EDGE)
    stretches = np.zeros(len(points))
    np.maximum.at(stretches, edges.ravel(), np.repeat(ratios, 2))
    return stretches


def _between(vertices: Floats, points: Floats, faces: Ints, size: SizeField, rng: np.random.Generator) -> Floats:
    """(k, 3) samples on triangles that are large for the local spacing, at a distance from the samples of vertices."""
    sizes = areas(points, faces)
    corners = points[faces]
    expected = _OVERSAMPLING * sizes / size(corners.mean(axis=1)) ** 2 if len(faces) else np.empty(0)
    count = np.floor(expected + rng.random(len(expected))).astype(np.int64)
    triangle = rng.permutation(np.repeat(np.arange(len(faces)), count))
    samples: Floats = np.einsum("nk,nka->na", rng.dirichlet((1.0, 1.0, 1.0), size=len(triangle)), corners[triangle])
    return samples[thin(samples, size(samples), vertices)] if len(samples) else samples
