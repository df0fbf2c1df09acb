# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Screw motions in batches: the turns that fit point sets best, and how far a screw carries along its axis."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .rotations import closest_rotations, rotation_vectors

# Covariances whose second singular value is below this part of the first belong to points in a line.
_LINE = 1e-10


def best_turns(covariances: Floats) -> Floats:
    """(k, 3) rotation vectors that turn point sets onto others in the least-squares sense (Kabsch 1976).

    Parameters
    ----------
    covariances : (k, 3, 3)
        Sums of weight times target times source (outer products), both from their centres. Where it has rank 1, the
        points of a set lie in one line, which leaves the spin about it free: they turn no further than their line.
        Points in one place do not turn.
    """
    left, sizes, right = np.linalg.svd(covariances)
    lines = np.flatnonzero(sizes[:, 1] <= _LINE * sizes[:, 0])
    turns = rotation_vectors(closest_rotations(covariances))
    source, target = right[lines, 0], left[lines, :, 0]
    axis, cosine = np.cross(source, target), np.einsum("ki,ki->k", source, target)
    sine = np.linalg.norm(axis, axis=1)
    # Opposite directions: half a turn about anything across the line.
    opposite = sine < _LINE
    axis = np.where(opposite[:, None], right[lines, 1], axis / np.where(opposite, 1.0, sine)[:, None])
    turns[lines] = np.where(sizes[lines, :1] > 0.0, np.arctan2(sine, cosine)[:, None] * axis, 0.0)
    return turns


def translation_factors(turns: Floats) -> Floats:
    """(k, 3, 3) matrices V(q) with b = V(q) v for twists (q, v): the integral of exp(s [q]x) over s in 0..1."""
    angles = np.linalg.norm(turns, axis=1)
    cross = np.cross(turns[:, None], np.eye(3)).transpose(0, 2, 1)
    # (1 - cos a) / a^2 without its cancellation.
    first = 0.5 * np.sinc(0.5 * angles / np.pi) ** 2
    safe = np.maximum(angles, 1e-4)
    second = np.where(angles < 1e-4, 1.0 / 6.0 - angles**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + first[:, None, None] * cross + second[:, None, None] * (cross @ cross))
