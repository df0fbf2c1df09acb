# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps components that are congruent in both keys rigid during the motion."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import covariances_by_label, means_by_label, sums_by_label
from ..numerics.rotations import rotation_matrices
from ..numerics.screws import best_turns

# Relative to a component's size: its keys are congruent if they deviate by less than the first, which covers modeling
# and single precision, and not congruent beyond the second. In between, the correction fades out.
_CONGRUENT, _OTHERWISE = 1e-4, 1e-3


class RigidParts:
    """Replaces each component that is congruent in both keys by the best-fitting rigid body (Kabsch 1976).

    The small deviation between the two keys is blended in. Components with still vertices are left as they are.

    Parameters
    ----------
    key0, key1 : (n, 3)
    still : (n,) bool
    weights : (n,)
        Positive weights of the vertices in fits.
    labels : (n,) int64
        Component of every vertex.
    """

    def __init__(self, key0: Floats, key1: Floats, still: Bools, weights: Floats, labels: Ints) -> None:
        count = int(labels.max(initial=-1)) + 1
        rests = np.bincount(labels, weights=still, minlength=count) > 0
        self._key0, self._weights, self._labels = key0, weights, labels
        self._members = np.flatnonzero(~rests[labels])
        missed = key1 - self._placed(key0, key1)
        distance, size = np.zeros(count), np.zeros(count)
        spread = key0 - means_by_label(labels, key0, weights, count)[labels]
        np.maximum.at(distance, labels, np.linalg.norm(missed, axis=1))
        np.maximum.at(size, labels, np.linalg.norm(spread, axis=1))
        ratio = distance / np.maximum(size, 1e-300)
        degree = np.clip((_OTHERWISE - ratio) / (_OTHERWISE - _CONGRUENT), 0.0, 1.0)
        degree[rests | (size == 0.0)] = 0.0
        self._members = np.flatnonzero(degree[labels] > 0.0)
        self._degree = degree[labels[self._members], None]
        self._sizes = size
        self._missed = missed[self._members]

    def placed(self, shape: Floats, time: float) -> Floats:
        """The shape (n, 3) at ``time``, in [0, 1], with its congruent components replaced by rigid ones."""
        if not len(self._members):
            return shape
        own, result = self._members, shape.copy()
        rigid = self._placed(self._key0, shape)[own] + time * self._missed
        result[own] += self._degree * (rigid - shape[own])
        return result

    def bent(self, shape: Floats) -> Bools:
        """(n,) the vertices of congruent components that a shape (n, 3) bends by more than congruent ones differ."""
        result = np.zeros(len(shape), dtype=bool)
        own = self._members
        if len(own):
            labels = self._labels[own]
            missed = np.zeros(len(self._sizes))
            np.maximum.at(missed, labels, np.linalg.norm(self._placed(self._key0, shape)[own] - shape[own], axis=1))
            result[own] = missed[labels] > _CONGRUENT * self._sizes[labels]
        return result

    def _placed(self, source: Floats, target: Floats) -> Floats:
        """(n, 3) target in which the members of each component are the rigidly moved source that fits them best."""
        own, moved = self._members, target.copy()
        parts = np.unique(self._labels[own], return_inverse=True)[1].ravel()
        weight = self._weights[own] / sums_by_label(parts, self._weights[own])[parts]
        centers = [means_by_label(parts, points[own], weight)[parts] for points in (source, target)]
        spread = [points[own] - center for points, center in zip((source, target), centers, strict=True)]
        turns = best_turns(covariances_by_label(parts, weight[:, None] * spread[1], spread[0]))
        moved[own] = centers[1] + np.einsum("nij,nj->ni", rotation_matrices(turns)[parts], spread[0])
        return moved
