# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys that are the pose of one joint: from such a key alone, the skin is known at every angle of the joint.

Linear blend skinning with one joint turned carries a vertex x to x + w (T x - x): T is the joint's rigid motion, and w
is how much of the vertex hangs on it. Each vertex of a key gives three equations for its one w, so two of three are
left to tell whether the key is such a pose. A sculpted key is not (compare Le & Deng 2012, "Smooth skinning
decomposition with rigid bones").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.grouped_sums import sums_by_label
from ..numerics.rotations import rotation_matrices
from ..numerics.screws import best_turns, translation_factors
from ..triangles.deformation import TriangleDeformation

# How far the pose may be from the key: of the size, as single precision leaves it, and of the longest way.
_MISSED, _MISSED_OF_WAY = 1e-5, 1e-3
# A small turn has no arc to speak of, and the direction of about half a turn is not known.
_LEAST_TURN, _MOST_TURN = np.radians(5.0), np.radians(170.0)
_STRETCHED = 1e-3  # triangles stretched by less are rigid
_SAME_TURN = 1e-3  # radians
_BEYOND = 0.01  # weights may be below 0 or above 1 by so much: rounding near the joint's axis


@dataclass(frozen=True, eq=False)
class JointPose:
    """A key as the pose of one joint.

    Parameters
    ----------
    base : (n, 3)
    turn : (3,)
        Rotation vector of the joint, radians.
    velocity : (3,)
        With the turn, the twist whose exponential is the joint's rigid motion.
    weights : (n,)
        How much of each vertex hangs on the joint, 0..1.
    rest : (n, 3)
        What the pose at full misses of the key: about rounding.
    """

    base: Floats
    turn: Floats
    velocity: Floats
    weights: Floats
    rest: Floats

    def at(self, share: float) -> Floats:
        """(n, 3) the skin with the joint turned by a ``share`` of its angle, 0..1; the key itself at 1."""
        return np.asarray(self.base + self.weights[:, None] * self._way(share) + share * self.rest)

    def _way(self, share: float) -> Floats:
        return _carried(self.base, share * self.turn, share * self.velocity) - self.base

    @classmethod
    def found(cls, base: Floats, key: Floats, faces: Ints) -> JointPose | None:
        """The pose that a key (n, 3) of ``base`` (n, 3) with triangles ``faces`` (m, 3) is; None if it is none.

        Examples
        --------
        >>> import numpy as np
        >>> strip = np.array([[x, y, 0.0] for x in range(4) for y in range(2)])
        >>> faces = np.array([[a, a + 2, a + 1] for a in range(6)])
        >>> hung = np.array([0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0])[:, None]
        >>> turned = (strip - [1, 0, 0]) @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + [1, 0, 0]
        >>> pose = JointPose.found(strip, strip + hung * (turned - strip), faces)
        >>> np.degrees(pose.turn).round(6), pose.weights.round(6).tolist()
        (array([ 0.,  0., 90.]), [0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0])
        >>> JointPose.found(strip, strip * [1.0, 2.0, 1.0], faces) is None
        True
        """
        rigid = _largest_turned_part(base, key, faces)
        if not len(rigid):
            return None
        turn, velocity = _motion(base[rigid], key[rigid])
        if not _LEAST_TURN <= float(np.linalg.norm(turn)) <= _MOST_TURN:
            return None
        way, moved = _carried(base, turn, velocity) - base, key - base
        squared = (way**2).sum(axis=1)
        weights = (moved * way).sum(axis=1) / np.maximum(squared, 1e-300)
        travel, size = float(np.linalg.norm(moved, axis=1).max()), float(np.linalg.norm(np.ptp(base, axis=0)))
        most = min(_MISSED * size, _MISSED_OF_WAY * travel)
        # What is on the joint's axis stays there, whatever its weight.
        weights[np.sqrt(squared) <= most] = 0.0
        if weights.min() < -_BEYOND or weights.max() > 1.0 + _BEYOND:
            return None
        rest = moved - weights[:, None] * way
        if float(np.linalg.norm(rest, axis=1).max()) > most:
            return None
        return cls(base, turn, velocity, weights, rest)


def _largest_turned_part(base: Floats, key: Floats, faces: Ints) -> Ints:
    """(k,) the vertices of the triangles that turn alike, with the largest area, among those that keep their shape."""
    deformation = TriangleDeformation.between(base, key, faces)
    turned = np.linalg.norm(deformation.turns, axis=1) >= _LEAST_TURN
    rigid = np.flatnonzero(turned & (np.abs(deformation.stretch.values - 1.0).max(axis=1, initial=0.0) < _STRETCHED))
    if not len(rigid):
        return np.empty(0, dtype=np.int64)
    turns = deformation.turns[rigid]
    cells, labels = np.unique(np.round(turns / _SAME_TURN), axis=0, return_inverse=True)
    fullest = cells[np.argmax(sums_by_label(labels.ravel(), deformation.weights[rigid]))] * _SAME_TURN
    alike = np.linalg.norm(turns - fullest, axis=1) <= 2.0 * _SAME_TURN
    return np.asarray(np.unique(deformation.faces[rigid[alike]]))


def _motion(source: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Rotation vector (3,) and velocity (3,) of the rigid motion that carries points (k, 3) onto others best."""
    centers = source.mean(axis=0), target.mean(axis=0)
    turn = best_turns(((target - centers[1]).T @ (source - centers[0]))[None])
    shift = centers[1] - rotation_matrices(turn)[0] @ centers[0]
    return turn[0], np.linalg.solve(translation_factors(turn)[0], shift)


def _carried(points: Floats, turn: Floats, velocity: Floats) -> Floats:
    """(n, 3) points (n, 3) after the rigid motion of a twist."""
    return np.asarray(points @ rotation_matrices(turn[None])[0].T + translation_factors(turn[None])[0] @ velocity)
