# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The quality ``exact``: a fold-free map that meets both keys.

The tetrahedra are as fine as the surface's edges. The map follows the motion from key to key (module ``continuation``),
and then the landmarks' weight is increased until they are met.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Bools, Floats
from ..keys.embedding import Embedding
from ..support.progress import told
from .continuation import FollowedPath, follow_path, turns_along
from .fold_free import LANDMARK_WEIGHT
from .local_meeting import Aim, meet_rest
from .own_crossings import crossing_vertices
from .stiff_landmarks import StiffFitter
from .volume import Volume

MET = 1e-4  # of the diagonal: a vertex is met if its distance is at most this
_WEIGHT_ON_THE_WAY = 1e6
_WEIGHTS = (1e7, 1e8, 1e9, 1e10)
_ITERATIONS = 12  # at most, for each weight
# So many weights all vertices go through; if no more than these are left then, the tetrahedra around them do the rest.
_AT_LEAST, _FEW = 2, 0.05
# Of the diagonal. Beyond this distance, the force of a landmark no longer grows. Otherwise landmarks that cannot be
# met, as where a key crosses itself, would keep others from being met.
_STRONGEST_AT = 1e-3
_LEAST_LENGTH = 0.05  # relative to the mean
_WEIGHT_AT_CROSSINGS = 1e-2  # relative to that of other landmarks


def meet_keys(
    embedding: Embedding, volume: Volume, targets: Sequence[Floats]
) -> Generator[float, None, tuple[Volume, FollowedPath]]:
    """Follow the motion and meet the second key.

    Parameters
    ----------
    embedding : Embedding
    volume : Volume
        Its tetrahedra are as fine as the surface.
    targets : sequence of (n, 3)
        Target positions of the vertices after each step, in cube units; the last is the second key.

    Yields
    ------
    float
        The fraction that is done, in [0, 1].

    Returns
    -------
    volume : Volume
        With smaller tetrahedra where vertices could not be met otherwise.
    followed : FollowedPath
    """
    mesh, landmarks = volume.mesh, volume.landmarks
    crossing = crossing_vertices(embedding)
    base = _weights(embedding, crossing)
    fitter = StiffFitter(mesh, landmarks, _WEIGHT_ON_THE_WAY / LANDMARK_WEIGHT * base)
    followed = yield from told(follow_path(fitter, targets), lambda part: 0.6 * part)
    diagonal = embedding.pair.diagonal * embedding.scale
    aim = Aim(embedding.key0, embedding.key1, base, ~crossing, MET * diagonal, _STRONGEST_AT * diagonal)
    mapped, weights = followed.maps[-1], base
    for number, weight in enumerate(_WEIGHTS, start=1):
        fitter = fitter.with_weights(weight / LANDMARK_WEIGHT * weights)
        mapped = fitter.fit(mapped, embedding.key1, _ITERATIONS)
        missed = np.linalg.norm(fitter.residuals(mapped, embedding.key1), axis=1)
        if number >= _AT_LEAST and np.count_nonzero((missed > aim.met) & aim.reachable) <= _FEW * len(missed):
            break
        weights = aim.pull(missed)
        yield 0.6 + 0.2 * number / len(_WEIGHTS)
    maps = np.concatenate([followed.maps[:-1], mapped[None]])
    finer, maps = yield from told(meet_rest(mesh, maps, aim), lambda part: 0.8 + 0.2 * part)
    if finer is not mesh:
        volume = replace(volume, mesh=finer)
        maps[0] = finer.points
    return volume, FollowedPath(maps, turns_along(finer, maps))


def _weights(embedding: Embedding, crossing: Bools) -> Floats:
    """(n,) weights of the vertices, with sum 1.

    They are inverse to the areas around vertices, as the stiffness of tetrahedra of equal weights is to the squares of
    their edges. Where a key crosses itself they are small: what cannot be met must not hold up what is around it.
    """
    lengths = np.sqrt(embedding.weights)
    lengths = np.maximum(lengths, _LEAST_LENGTH * lengths.mean())
    weights = np.where(crossing, _WEIGHT_AT_CROSSINGS, 1.0) / lengths**2
    return np.asarray(weights / weights.sum())
