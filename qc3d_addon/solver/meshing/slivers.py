# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape of tetrahedra, and the removal of slivers from Delaunay meshes whose vertices are free to move."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from scipy.spatial import Delaunay

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import means_by_label
from ..tets.mesh import OPPOSITE_FACES, TetMesh, edge_matrices
from .poisson_disk import SizeField

WANTED_ANGLE = 12.0  # degrees
_SMOOTHING_SWEEPS = 5
_REPAIR_ROUNDS = 40
_STEP = 0.3  # of the local distance between samples
_WALL = 1e-3  # what is not on a face of the cube stays this far from it


def smallest_dihedral_angles(mesh: TetMesh) -> Floats:
    """(M,) smallest of the six dihedral angles of each tetrahedron, in degrees; 70.5 for the regular one."""
    corners = mesh.points[mesh.tets[:, OPPOSITE_FACES]]
    normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    # A face without area keeps its zero normal; the flat tetrahedron shows in the angle between its other faces.
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), np.finfo(np.float64).tiny)
    # The angle between two faces is the supplement of that between their outward normals.
    cosines = -np.einsum("mia,mja->mij", normals, normals)
    first, second = np.triu_indices(4, 1)
    angles: Floats = np.degrees(np.arccos(np.minimum(cosines[:, first, second].max(axis=1), 1.0)))
    return angles


def triangulate(samples: Floats) -> Ints:
    """Delaunay tetrahedra (M, 4), positively oriented, of samples (N, 3) that include the cube's corners.

    Tetrahedra whose corners share a face of the cube have no volume and are left out; they only ever line the hull.
    """
    # In an order of their own: the one in which they are found depends on rounding, and what follows draws lots.
    tets: Ints = np.sort(np.asarray(Delaunay(samples).simplices, dtype=np.int64), axis=1)
    tets = tets[np.lexsort(tets.T[::-1])]
    negative = np.linalg.det(edge_matrices(samples, tets)) < 0.0
    tets[negative] = tets[negative][:, [0, 1, 3, 2]]
    corners = samples[tets]
    flat = ((corners == corners[:, :1]) & ((corners == 0.0) | (corners == 1.0))).all(axis=1).any(axis=1)
    solid: Ints = tets[~flat]
    return solid


def sliver_free(samples: Floats, size: SizeField, rng: Generator) -> TetMesh:
    """Delaunay mesh of moved samples, whose smallest dihedral angle exceeds 12 degrees wherever that can be reached.

    First a few sweeps carry every sample to the weighted centroid of its tetrahedra (Chen & Holst 2011, *Efficient
    mesh optimization schemes based on optimal Delaunay triangulations*); then one corner of each sliver that is left
    moves at random, and the mesh is made anew, until none is left (in the spirit of Tournois, Srinivasan & Alliez
    2009, *Perturbing slivers in 3D Delaunay meshes*). Every mesh on the way is Delaunay, hence conforming. Samples on
    the cube's faces slide in them, those on its edges along them; its corners stay.

    Parameters
    ----------
    samples : (N, 3) float64
        Samples of the unit cube, its corners included.
    size : callable
        The local distance between samples.
    """
    free = (samples != 0.0) & (samples != 1.0)
    for _ in range(_SMOOTHING_SWEEPS):
        samples = _held(samples, _centroids(TetMesh(samples, triangulate(samples)), size), free)
    mesh = TetMesh(samples, triangulate(samples))
    angles = smallest_dihedral_angles(mesh)
    best, best_angle = mesh, angles.min()
    for _ in range(_REPAIR_ROUNDS):
        slivers = mesh.tets[angles < WANTED_ANGLE]
        if not len(slivers):
            break
        chosen = np.unique(slivers[np.arange(len(slivers)), rng.integers(0, 4, len(slivers))])
        direction = rng.normal(size=(len(chosen), 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        moved = samples.copy()
        moved[chosen] += _STEP * size(samples[chosen])[:, None] * direction
        samples = _held(samples, moved, free)
        mesh = TetMesh(samples, triangulate(samples))
        angles = smallest_dihedral_angles(mesh)
        if angles.min() > best_angle:
            best, best_angle = mesh, angles.min()
    return best


def _centroids(mesh: TetMesh, size: SizeField) -> Floats:
    """(N, 3): mean of the centroids around each vertex, weighted so that the grading is kept."""
    centroids = mesh.centroids
    weights = mesh.volumes / size(centroids) ** 3
    corners, count = mesh.tets.ravel(), len(mesh.points)
    return means_by_label(corners, np.repeat(centroids, 4, axis=0), np.repeat(weights, 4), count)


def _held(before: Floats, after: Floats, free: Bools) -> Floats:
    """Moved samples, except for the coordinates held by the cube's faces."""
    return np.where(free, np.clip(after, _WALL, 1.0 - _WALL), before)
