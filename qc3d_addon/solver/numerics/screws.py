# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of screw motions: rigid motions as exponentials of twists, and least-squares rotations of point sets."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .rotations import closest_rotations, rotation_vectors

# Points are collinear if the second singular value of their covariance is below this fraction of the first.
_LINE = 1e-10


def best_turns(covariances: Floats) -> Floats:
    """(k, 3) rotation vectors that turn point sets onto others in the least-squares sense (Kabsch 1976).

    Parameters
    ----------
    covariances : (k, 3, 3)
        Weighted sums of the outer products target sourceᵀ of points relative to their centroids.

    Notes
    -----
    The rotation of collinear points about their own line is undetermined; they take the smallest rotation that carries
    one line to the other. The rotation of coincident points is zero.
    """
    left, sizes, right = np.linalg.svd(covariances)
    lines = np.flatnonzero(sizes[:, 1] <= _LINE * sizes[:, 0])
    turns = rotation_vectors(closest_rotations(covariances))
    source, target = right[lines, 0], left[lines, :, 0]
    axis, cosine = np.cross(source, target), np.einsum("ki,ki->k", source, target)
    sine = np.linalg.norm(axis, axis=1)
    # Opposite directions: half a turn about any axis perpendicular to the line.
    opposite = sine < _LINE
    axis = np.where(opposite[:, None], right[lines, 1], axis / np.where(opposite, 1.0, sine)[:, None])
    turns[lines] = np.where(sizes[lines, :1] > 0.0, np.arctan2(sine, cosine)[:, None] * axis, 0.0)
    return turns


def translation_factors(turns: Floats) -> Floats:
    """(k, 3, 3) matrices V(q), the integrals of exp(s [q]x) over s in 0..1, for rotation vectors q (k, 3), radians.

    The rigid motion x -> R x + b that is the exponential of the twist (q, v) has the translation b = V(q) v.
    """
    angles = np.linalg.norm(turns, axis=1)
    cross = np.cross(turns[:, None], np.eye(3)).transpose(0, 2, 1)
    # (1 - cos a) / a^2, written without cancellation.
    first = 0.5 * np.sinc(0.5 * angles / np.pi) ** 2
    safe = np.maximum(angles, 1e-4)
    second = np.where(angles < 1e-4, 1.0 / 6.0 - angles**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + first[:, None, None] * cross + second[:, None, None] * (cross @ cross))
