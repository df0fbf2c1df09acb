# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Extra turns: full turns of whole parts, about their own axes, which two keys alone do not determine."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..keys.embedding import Embedding
from ..numerics.grouped_sums import covariances_by_label, means_by_label, sums_by_label
from ..numerics.rotations import rotation_matrices
from ..surface.path import SurfacePath

# Turns smaller than this, in radians, are rounding and have no axis.
_LEAST_TURN = 1e-6
# Still vertices no further apart than this in cube units, or from a line, leave a part free to spin.
_LINE = 1e-5


class ExtraSpins:
    """Adds full turns to shapes between two keys; at the keys nothing changes.

    Where nothing is still, everything spins as one, about the axis of its rigid motion. Otherwise each component spins
    about the axis about which it turns; one is held where its still vertices span more than that axis.

    Parameters
    ----------
    embedding : Embedding
    surface : SurfacePath
        Tells the components and how they turn.
    turns : int
        Number of full turns, in the direction in which a part turns; against it where negative.
    """

    def __init__(self, embedding: Embedding, surface: SurfacePath, turns: int) -> None:
        still = embedding.still
        whole = not still.any()
        labels = np.zeros(len(still), dtype=np.int64) if whole else surface.components
        directions = embedding.motion.turn + (np.zeros((1, 3)) if whole else _mean_turns(surface, labels))
        sizes = np.linalg.norm(directions, axis=1)
        free = (sizes > _LEAST_TURN) & ~_held(embedding.key0, still, labels) & (turns != 0)
        self._vertices = np.flatnonzero(free[labels])
        number = np.cumsum(free) - 1
        self._parts: Ints = number[labels[self._vertices]]
        self._spins: Floats = 2.0 * np.pi * turns * directions[free] / sizes[free, None]
        # The middle of a part that turns about still vertices is among them.
        pivots = still | ~np.isin(labels, labels[still])
        shares = np.where(pivots, embedding.weights, 0.0)[self._vertices]
        self._shares: Floats = shares / sums_by_label(self._parts, shares)[self._parts]

    def __bool__(self) -> bool:
        return bool(len(self._vertices))

    def apply(self, positions: Floats, time: float) -> Floats:
        """Positions (n, 3) in cube units at ``time``, spun."""
        if not self:
            return positions
        members = positions[self._vertices]
        middles = sums_by_label(self._parts, self._shares[:, None] * members)[self._parts]
        rotations = rotation_matrices(time * self._spins)[self._parts]
        spun = positions.copy()
        spun[self._vertices] = middles + np.einsum("nij,nj->ni", rotations, members - middles)
        return spun


def _mean_turns(surface: SurfacePath, labels: Ints) -> Floats:
    """(components, 3) weighted means of the rotation vectors of each component's triangles; zero where it has none."""
    deformation = surface.deformation
    owner = labels[surface.vertices[deformation.faces[:, 0]]]
    # As the path has them turn, which may be the long way round; those of parts with a twist are told by the keys.
    turns, twisted = surface.turning.swing, surface.turning.twist.any(axis=1)
    if twisted.any():
        turns = np.where(twisted[:, None], surface.whole_deformation().turns, turns)
    return means_by_label(owner, turns, deformation.weights, int(labels.max()) + 1)


def _held(points: Floats, still: Bools, labels: Ints) -> Bools:
    """(components,) whether the still vertices of a component lie on no common line."""
    count = int(labels.max()) + 1
    members, owner = points[still], labels[still]
    spread = members - means_by_label(owner, members, count=count)[owner]
    return np.asarray(np.linalg.eigvalsh(covariances_by_label(owner, spread, spread, count))[:, 1] > _LINE**2)
