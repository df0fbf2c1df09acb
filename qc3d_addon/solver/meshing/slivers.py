# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape quality of tetrahedra, and removal of slivers from Delaunay meshes by moving their vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial import Delaunay

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import means_by_label
from ..tets.mesh import OPPOSITE_FACES, TetMesh, edge_matrices
from .poisson_disk import SizeField

WANTED_ANGLE = 12.0  # degrees; smaller dihedral angles condition the fit badly, larger ones cannot be reached reliably
_SMOOTHING_SWEEPS = 5  # each triangulates anew; further ones improve little
_REPAIR_ROUNDS = 40  # a cap; a few usually suffice
_STEP = 0.3  # of the local distance between samples: enough to open a sliver, too little to leave a gap
_WALL = 1e-3  # smallest distance from a face of the cube for samples that are not on it


def smallest_dihedral_angles(mesh: TetMesh) -> Floats:
    """(M,) smallest of the six dihedral angles of each tetrahedron, in degrees; 70.5 if it is regular."""
    corners = mesh.points[mesh.tets[:, OPPOSITE_FACES]]
    normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    # A face without area keeps its zero normal: the other faces' angles show that the tetrahedron is flat.
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), np.finfo(np.float64).tiny)
    # The dihedral angle of two faces is the supplement of the angle between their outward normals.
    cosines = -np.einsum("mia,mja->mij", normals, normals)
    first, second = np.triu_indices(4, 1)
    angles: Floats = np.degrees(np.arccos(np.minimum(cosines[:, first, second].max(axis=1), 1.0)))
    return angles


def triangulate(samples: Floats) -> Ints:
    """(M, 4) Delaunay tetrahedra, positively oriented, of samples (N, 3) that include the cube's corners.

    Tetrahedra with all corners on one face of the cube have no volume; they occur only along the hull and are left out.
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


@dataclass(frozen=True)
class Effort:
    """How much work goes into the shape of tetrahedra.

    Parameters
    ----------
    sweeps
        Smoothing sweeps over all samples.
    rounds
        The most rounds in which slivers are repaired.
    angle
        The dihedral angle below which a tetrahedron counts as a sliver, degrees.
    """

    sweeps: int = 5
    rounds: int = 40
    angle: float = WANTED_ANGLE


def sliver_free(
    samples: Floats, size: SizeField, rng: Generator, effort: Effort = Effort(), in_place: int = 0
) -> TetMesh:
    """Move samples so that the dihedral angles of their Delaunay mesh exceed 12 degrees, as far as that is possible.

    First, smoothing sweeps move every sample to the weighted centroid of its tetrahedra (Chen & Holst 2011, *Efficient
    mesh optimization schemes based on optimal Delaunay triangulations*). Then, until no sliver is left, one random
    corner of each sliver moves at random and the samples are triangulated again (in the spirit of Tournois, Srinivasan
    & Alliez 2009, *Perturbing slivers in 3D Delaunay meshes*). Every mesh along the way is Delaunay and therefore
    conforming. Samples on the cube's faces and edges slide within them; the cube's corners stay.

    Parameters
    ----------
    samples : (N, 3) float64
        Samples of the unit cube, including its corners.
    size : callable
        Local distance between samples at positions (n, 3).
    rng : Generator
    effort : Effort
    in_place : int
        So many samples, the first ones, are not smoothed.

    Returns
    -------
    TetMesh
        The mesh with the largest smallest angle that was found.
    """
    free = (samples != 0.0) & (samples != 1.0)
    smoothed = free & (np.arange(len(samples)) >= in_place)[:, None]
    for _ in range(effort.sweeps):
        samples = _held(samples, _centroids(TetMesh(samples, triangulate(samples)), size), smoothed)
    mesh = TetMesh(samples, triangulate(samples))
    angles = smallest_dihedral_angles(mesh)
    best, best_angle = mesh, angles.min()
    for _ in range(effort.rounds):
        slivers = mesh.tets[angles < effort.angle]
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
    """(N, 3) mean of the centroids of the tetrahedra around each vertex, weighted so that the grading is kept."""
    centroids = mesh.centroids
    weights = mesh.volumes / size(centroids) ** 3
    corners, count = mesh.tets.ravel(), len(mesh.points)
    return means_by_label(corners, np.repeat(centroids, 4, axis=0), np.repeat(weights, 4), count)


def _held(before: Floats, after: Floats, free: Bools) -> Floats:
    """The moved samples, without changes to coordinates that are fixed by the cube's faces."""
    return np.where(free, np.clip(after, _WALL, 1.0 - _WALL), before)
