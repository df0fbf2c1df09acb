# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Anchors of the vertices while there is no volume: each component moves along the screw between its keys."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import covariances_by_label, means_by_label, sums_by_label
from ..numerics.rotations import rotation_matrices
from ..numerics.screws import best_turns, translation_factors


class ScrewAnchors:
    """Each connected component moves along its own screw motion; the remaining difference is interpolated linearly.

    A component with still vertices, or with fewer than three vertices, has no screw motion of its own.

    Parameters
    ----------
    key0, key1 : (n, 3)
    still : (n,) bool
    weights : (n,)
        Positive weights of the vertices in the fit of the screws.
    labels : (n,) int64
        Component of every vertex, 0, 1, 2 and so on.
    turns : (components, 3), optional
        Rotation vectors of the components' motions, radians. Where they are not finite, and without them, the rotation
        is the best fit of the positions. That can be half a turn away from how every triangle turns, as where a thin
        wing bends from one side to the other, and tells nothing about the direction of half a turn.
    """

    def __init__(
        self, key0: Floats, key1: Floats, still: Bools, weights: Floats, labels: Ints, turns: Floats | None = None
    ) -> None:
        self._key0 = key0
        moves = np.bincount(labels) >= 3
        moves[labels[still]] = False
        self._members = np.flatnonzero(moves[labels])
        parts = np.unique(labels[self._members], return_inverse=True)[1].ravel()
        source, target = key0[self._members], key1[self._members]
        weight = weights[self._members]
        weight = weight / sums_by_label(parts, weight)[parts]
        centers = [means_by_label(parts, points, weight) for points in (source, target)]
        spread = [points - center[parts] for points, center in zip((source, target), centers, strict=True)]
        self._turns = best_turns(covariances_by_label(parts, weight[:, None] * spread[1], spread[0]))
        if turns is not None:
            told = turns[np.unique(labels[self._members])]
            self._turns = np.where(np.isfinite(told), told, self._turns)
        rotations = rotation_matrices(self._turns)
        shift = centers[1] - np.einsum("kij,kj->ki", rotations, centers[0])
        self._velocities = np.linalg.solve(translation_factors(self._turns), shift[:, :, None])[:, :, 0]
        self._parts: Ints = parts.astype(np.int64)
        self._missing = key1 - self._moved(1.0)

    def _moved(self, time: float) -> Floats:
        turns = time * self._turns
        rotations = rotation_matrices(turns)
        shifts = np.einsum("kij,kj->ki", translation_factors(turns), time * self._velocities)
        moved = self._key0.copy()
        moved[self._members] = (
            np.einsum("nij,nj->ni", rotations[self._parts], self._key0[self._members]) + shifts[self._parts]
        )
        return moved

    def positions(self, time: float) -> Floats:
        """(n, 3) anchors at ``time`` in 0..1; they are the keys at 0 and 1."""
        return self._moved(time) + time * self._missing
