# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The quality ``exact``: a fold-free map that meets both keys.

A coarse map finds the way from key to key (module ``continuation``). It is carried over to tetrahedra as fine as the
surface's own edges, the few folds that this makes are taken away, and the landmarks' weight is raised until they are
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

MET = 1e-4  # of the diagonal: a vertex that is missed by no more is met
_WEIGHTS = (1e5, 1e6, 1e7, 1e8)
_ITERATIONS = (15, 15, 12, 6)  # with each weight, at most; of smaller meshes than this up to four times as many
_MANY_TETS, _MOST_TIMES = 50_000, 4.0
_MORE_ROUNDS, _FEW, _PROGRESS = 6, 0.005, 0.9
_REPAIR_ITERATIONS = 15
# Landmarks that are missed by more than this part of the diagonal do not pull harder with it: what cannot be reached,
# such as where a key crosses itself, would hold up all that can.
_STRONGEST_AT = 1e-3
_LEAST_WEIGHT = 0.05  # of the mean
_WEIGHT_AT_CROSSINGS = 1e-2  # of others


@dataclass(frozen=True, eq=False)
class MetKeys:
    """A map that meets both keys, with what was on its way.

    Parameters
    ----------
    mesh : TetMesh
    landmarks : (n, N) sparse
        Barycentric coordinates of the first key's vertices.
    maps : (K + 1, N, 3)
        Maps without folds on the way, evenly spaced in time: the identity first, the one that meets the second key
        last.
    turns : (M, 3)
        Rotation vectors of the tetrahedra of the last map, in the branch that the motion takes.
    """

    mesh: TetMesh
    landmarks: csr_array
    maps: Floats
    turns: Floats


def meet_keys(
    embedding: Embedding, coarse: TetMesh, mesh: TetMesh, targets: Sequence[Floats]
) -> Generator[float, None, MetKeys]:
    """Find the way with a coarse mesh and meet the second key with a fine one.

    Parameters
    ----------
    embedding : Embedding
    coarse, mesh : TetMesh
        Fillings of the cube; the second one as fine as the surface.
    targets : sequence of (n, 3)
        Where the vertices should be after each step of the way, cube units; the second key last.

    Yields
    ------
    float
        The part that is done, 0..1.
    """
    base = _weights(embedding)
    coarse_landmarks = interpolation_matrix(coarse, embedding.key0)
    way = follow_path(FoldFreeFitter(coarse, coarse_landmarks, base), targets)
    followed = yield from told(way, lambda part: 0.1 * part)
    followed.maps[-1] = StiffFitter(coarse, coarse_landmarks, _WEIGHTS[0] / LANDMARK_WEIGHT * base).fit(
        followed.maps[-1], embedding.key1, _ITERATIONS[0]
    )
    fitter = StiffFitter(mesh, interpolation_matrix(mesh, embedding.key0), base)
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
        left = np.count_nonzero(missed[reachable] > MET)
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
    return MetKeys(mesh, fitter.landmarks, maps, turns)


def crossing_vertices(embedding: Embedding) -> Bools:
    """(n,) whether a vertex belongs to triangles that cross in either key, or to triangles beside those.

    No map without folds meets both keys there. All vertices where so many triangles overlap that it is not known.
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
    """A map without folds (N, 3) near a coarse one, or, where its folds stay, between it and the map before it."""
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
