# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The quality ``exact``: a fold-free map that meets both keys.

The tetrahedra are as fine as the surface's edges. The map follows the motion from key to key (module ``continuation``),
and then the landmarks' weight is increased until they are met.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Bools, Floats
from ..keys.embedding import Embedding
from ..support.progress import told
from ..tets.mesh import TetMesh
from .continuation import FollowedPath, follow_path
from .fold_free import LANDMARK_WEIGHT
from .own_crossings import crossing_vertices
from .stiff_landmarks import StiffFitter

MET = 1e-4  # of the diagonal: a vertex is met if its distance is at most this
_WEIGHT_ON_THE_WAY = 1e6
_WEIGHTS = (1e7, 1e8, 1e9, 1e10)
_ITERATIONS = 12  # at most, for each weight
_MORE_ROUNDS, _FEW, _PROGRESS = 6, 0.005, 0.9
# Of the diagonal. Beyond this distance, the force of a landmark no longer grows. Otherwise landmarks that cannot be
# met, as where a key crosses itself, would keep others from being met.
_STRONGEST_AT = 1e-3
_LEAST_LENGTH = 0.05  # relative to the mean
_WEIGHT_AT_CROSSINGS = 1e-2  # relative to that of other landmarks


def meet_keys(
    embedding: Embedding, mesh: TetMesh, landmarks: csr_array, targets: Sequence[Floats]
) -> Generator[float, None, FollowedPath]:
    """Follow the motion and meet the second key.

    Parameters
    ----------
    embedding : Embedding
    mesh : TetMesh
        A tetrahedral mesh of the cube, as fine as the surface.
    landmarks : (n, N) sparse
        Barycentric coordinates of the first key's vertices.
    targets : sequence of (n, 3)
        Target positions of the vertices after each step, in cube units; the last is the second key.

    Yields
    ------
    float
        The fraction that is done, in [0, 1].
    """
    crossing = crossing_vertices(embedding)
    base = _weights(embedding, crossing)
    fitter = StiffFitter(mesh, landmarks, _WEIGHT_ON_THE_WAY / LANDMARK_WEIGHT * base)
    followed = yield from told(follow_path(fitter, targets), lambda part: 0.6 * part)
    diagonal = embedding.pair.diagonal * embedding.scale
    reachable = ~crossing
    mapped, weights, before = followed.maps[-1], base, len(reachable)
    schedule = [*_WEIGHTS, *[_WEIGHTS[-1]] * _MORE_ROUNDS]
    for number, weight in enumerate(schedule):
        fitter = fitter.with_weights(weight / LANDMARK_WEIGHT * weights)
        mapped = fitter.fit(mapped, embedding.key1, _ITERATIONS)
        missed = np.linalg.norm(fitter.residuals(mapped, embedding.key1), axis=1) / diagonal
        left = int(np.count_nonzero(missed[reachable] > MET))
        if missed.max() <= 0.5 * MET:
            break
        # More rounds only where many are left, and as long as they help.
        if number >= len(_WEIGHTS) - 1 and (left <= _FEW * len(missed) or left > _PROGRESS * before):
            break
        before = left
        weights = base * np.minimum(1.0, _STRONGEST_AT / np.maximum(missed, 1e-300))
        yield 0.6 + 0.4 * min(1.0, (number + 1) / len(_WEIGHTS))
    return followed.ending_with(mesh, mapped)


def _weights(embedding: Embedding, crossing: Bools) -> Floats:
    """(n,) weights of the vertices, with sum 1.

    They are inverse to the areas around vertices, as the stiffness of tetrahedra of equal weights is to the squares of
    their edges. Where a key crosses itself they are small: what cannot be met must not hold up what is around it.
    """
    lengths = np.sqrt(embedding.weights)
    lengths = np.maximum(lengths, _LEAST_LENGTH * lengths.mean())
    weights = np.where(crossing, _WEIGHT_AT_CROSSINGS, 1.0) / lengths**2
    return np.asarray(weights / weights.sum())
