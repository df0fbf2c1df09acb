# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The quality ``exact``: a fold-free map that meets both keys.

A coarse map follows the motion from key to key (module ``continuation``). It is transferred to tetrahedra as fine as
the surface's edges, the few folds that this causes are removed, and the landmarks' weight is increased until they are
met.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Bools, Floats
from ..collision.box_tree import CrowdedError
from ..collision.crossings import crossing_pairs
from ..keys.embedding import Embedding
from ..maps.representation import polar_decomposition
from ..numerics.rotations import nearest_branch, rotation_vectors
from ..support.progress import told
from ..tets.mesh import TetMesh
from ..tets.point_location import interpolation_matrix, locate
from .continuation import follow_path
from .fold_free import LANDMARK_WEIGHT, FoldFreeFitter
from .stiff_landmarks import StiffFitter
from .unfolding import unfolded_nearby

MET = 1e-4  # of the diagonal: a vertex is met if its distance is at most this
_WEIGHTS = (1e5, 1e6, 1e7, 1e8)
_ITERATIONS = (15, 15, 12, 6)  # largest number for each weight; up to four times as many for smaller meshes
_MANY_TETS, _MOST_TIMES = 50_000, 4.0
_MORE_ROUNDS, _FEW, _PROGRESS = 6, 0.005, 0.9
_REPAIR_ITERATIONS = 15
# Of the diagonal. Beyond this distance, the force of a landmark no longer grows. Otherwise landmarks that cannot be
# met, as where a key crosses itself, would keep others from being met.
_STRONGEST_AT = 1e-3
_LEAST_WEIGHT = 0.05  # relative to the mean
_WEIGHT_AT_CROSSINGS = 1e-2  # relative to that of other landmarks


@dataclass(frozen=True, eq=False)
class MetKeys:
    """A map that meets both keys, with the maps of the motion in between.

    Parameters
    ----------
    maps : (K + 1, N, 3)
        Fold-free maps, evenly spaced in time, from the identity to the one that meets the second key.
    turns : (M, 3)
        Rotation vectors of the last map's tetrahedra, in the branch that the motion takes.
    """

    maps: Floats
    turns: Floats


def meet_keys(
    embedding: Embedding, coarse: TetMesh, mesh: TetMesh, landmarks: csr_array, targets: Sequence[Floats]
) -> Generator[float, None, MetKeys]:
    """Follow the motion with a coarse mesh and meet the second key with a fine one.

    Parameters
    ----------
    embedding : Embedding
    coarse, mesh : TetMesh
        Tetrahedral meshes of the cube; the second is as fine as the surface.
    landmarks : (n, N) sparse
        Barycentric coordinates of the first key's vertices in the fine mesh.
    targets : sequence of (n, 3)
        Target positions of the vertices after each step, in cube units; the last is the second key.

    Yields
    ------
    float
        The fraction that is done, in [0, 1].
    """
    base = _weights(embedding)
    coarse_landmarks = interpolation_matrix(coarse, embedding.key0)
    way = follow_path(FoldFreeFitter(coarse, coarse_landmarks, base), targets)
    followed = yield from told(way, lambda part: 0.1 * part)
    followed.maps[-1] = StiffFitter(coarse, coarse_landmarks, _WEIGHTS[0] / LANDMARK_WEIGHT * base).fit(
        followed.maps[-1], embedding.key1, _ITERATIONS[0]
    )
    fitter = StiffFitter(mesh, landmarks, base)
    carry = interpolation_matrix(coarse, mesh.points)
    maps = np.empty((len(followed.maps), *mesh.points.shape))
    maps[0] = mesh.points
    for step in range(1, len(maps)):
        maps[step] = _carried(fitter, carry, followed.maps[step], maps[step - 1])
        yield 0.1 + 0.1 * step / len(maps)
    diagonal = embedding.pair.diagonal * embedding.scale
    weights, times = base, min(max(_MANY_TETS / len(mesh.tets), 1.0), _MOST_TIMES)
    reachable = ~crossing_vertices(embedding)
    before = len(reachable)
    schedule = [*zip(_WEIGHTS, _ITERATIONS, strict=True), *[(_WEIGHTS[-2], _ITERATIONS[0])] * _MORE_ROUNDS]
    for number, (weight, iterations) in enumerate(schedule):
        fitter = fitter.with_weights(weight / LANDMARK_WEIGHT * weights)
        maps[-1] = fitter.fit(maps[-1], embedding.key1, round(times * iterations))
        missed = np.linalg.norm(fitter.residuals(maps[-1], embedding.key1), axis=1) / diagonal
        left = int(np.count_nonzero(missed[reachable] > MET))
        if missed.max() <= 0.5 * MET:
            break
        # More rounds only where many are left, and as long as they help.
        if number >= len(_WEIGHTS) - 1 and (left <= _FEW * len(missed) or left > _PROGRESS * before):
            break
        before = left
        weights = base * np.minimum(1.0, _STRONGEST_AT / np.maximum(missed, 1e-300))
        yield 0.2 + 0.8 * min(1.0, (number + 1) / len(_WEIGHTS))
    turned = rotation_vectors(polar_decomposition(mesh.jacobians(maps[-1])).rotation)
    turns = nearest_branch(turned, followed.turns[locate(coarse, mesh.centroids)[0]])
    return MetKeys(maps, turns)


def crossing_vertices(embedding: Embedding) -> Bools:
    """(n,) whether a vertex belongs to triangles that cross in either key, or to their neighbors.

    No fold-free map meets both keys there. True for all vertices if too many triangles overlap to be examined.
    """
    faces = embedding.pair.welded_faces
    found = np.zeros(len(embedding.key0), dtype=bool)
    for key in (embedding.key0, embedding.key1):
        try:
            crossing = crossing_pairs(key, faces)
        except CrowdedError:
            return np.ones(len(found), dtype=bool)
        found[faces[crossing.ravel()].ravel()] = True
    found[faces[found[faces].any(axis=1)].ravel()] = True
    return found


def _carried(fitter: FoldFreeFitter, carry: csr_array, coarse: Floats, before: Floats) -> Floats:
    """A fold-free map (N, 3) close to a coarse one or, if its folds remain, between it and the previous map."""
    mesh = fitter.mesh
    values = np.where(mesh.on_cube_face, mesh.points, carry @ coarse)
    found = unfolded_nearby(mesh, values)
    return fitter.fit(before, fitter.landmarks @ values, _REPAIR_ITERATIONS) if found is None else found


def _weights(embedding: Embedding) -> Floats:
    """(n,) weights of the vertices, with sum 1.

    They are as the lengths around vertices, the roots of areas, so that tetrahedra of all sizes resist alike. Where a
    key crosses itself they are small: what cannot be met must not hold up what is around it.
    """
    lengths = np.sqrt(embedding.weights)
    lengths = np.maximum(lengths, _LEAST_WEIGHT * lengths.mean())
    weights = np.where(crossing_vertices(embedding), _WEIGHT_AT_CROSSINGS, 1.0) * lengths
    return np.asarray(weights / weights.sum())
