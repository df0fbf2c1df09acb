# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a frame stands: its calm parts beside the straight lines between the keys, or all of it beside a course.

Lengths, turns and volumes tell a frame's shape and leave its place to weak anchors, so that where nothing is still the
whole frame would drift. It is carried rigidly to where the vertices that travel least go straight. In a chain, the
keys before and after tell more: as far as a frame follows its course, it is carried to where it is nearest to that.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..keys.embedding import NEARLY_STILL, STILL_TOLERANCE, Embedding
from ..numerics.grouped_sums import sums_by_label
from ..numerics.rising import risen
from ..numerics.rotations import rotation_matrices, rotation_vectors
from ..surface.path import SurfacePath
from .course import Course

# Vertices that travel less than this part of all count most.
_CALM_PERCENTILE = 25.0
# Of the way: where a rigid motion of the whole leaves less than this, parts of it are calm to a lesser degree only; and
# of that, what is left by rounding.
_MOSTLY_RIGID, _EXACTLY_RIGID = 0.2, 1e-5
# Calm parts that turn by less than the first between the keys tell how a frame is turned, and not beyond the second: of
# what turns far about a spine that is still, straight lines tell no turn.
_TURNS_LITTLE, _TURNS_FAR = np.radians(45.0), np.radians(90.0)
# Steps of the alignment; frames are a few degrees away, and each step leaves the third power of the angle.
_STEPS = 3
# Of the moments of inertia: what lies in a line is not turned about it.
_RIDGE = 1e-12
# How fast the move sets in beside an inner key, where it must not change velocities.
_ONSET = 4


@dataclass(frozen=True, eq=False)
class RigidMove:
    """The rigid motion x -> R (x - c) + c + d.

    Parameters
    ----------
    turn : (3,)
        Rotation vector of R, radians.
    center : (3,)
        c.
    shift : (3,)
        d.
    """

    turn: Floats
    center: Floats
    shift: Floats

    @classmethod
    def between(cls, shape: Floats, target: Floats, weights: Floats) -> RigidMove:
        """Nearly the best rigid motion of the points ``shape`` (n, 3) onto ``target`` with weights (n,) of sum 1.

        A few Gauss-Newton steps from rest: they find what is a few degrees away and, other than the best fit, change
        gradually with the points, never by half a turn where the target is flattened or reversed.
        """
        center, offsets = weights @ shape, target - shape
        shift = weights @ offsets
        # Differences, not positions, go into the moments: they are zero where the target is met, which counts most.
        spread, missing = shape - center, offsets - shift
        weighted = weights[:, None] * spread
        spreads, moments = weighted.T @ spread, weighted.T @ missing
        rotation = np.eye(3)
        floor = _RIDGE * float(np.trace(spreads)) + 1e-300
        for _ in range(_STEPS):
            turned = rotation @ spreads @ rotation.T
            left = rotation @ (moments + spreads @ (np.eye(3) - rotation.T))
            inertia = (np.trace(turned) + floor) * np.eye(3) - turned
            moment = np.array([left[1, 2] - left[2, 1], left[2, 0] - left[0, 2], left[0, 1] - left[1, 0]])
            rotation = rotation_matrices(np.linalg.solve(inertia, moment)[None])[0] @ rotation
        return cls(rotation_vectors(rotation[None])[0], center, shift)

    def scaled(self, part: float, turning: float = 1.0) -> RigidMove:
        """A part, 0..1, of the motion, and of the rotation only the part ``turning``, 0..1, of that."""
        return RigidMove(part * turning * self.turn, self.center, part * self.shift)

    def apply(self, points: Floats) -> Floats:
        """Points (k, 3), carried along."""
        return np.asarray((points - self.center) @ self._rotation.T + (self.center + self.shift))

    def undo(self, points: Floats) -> Floats:
        """Points (k, 3), carried back."""
        return np.asarray((points - (self.center + self.shift)) @ self._rotation + self.center)

    def undo_vectors(self, vectors: Floats) -> Floats:
        """Displacements (k, 3), turned back."""
        return np.asarray(vectors @ self._rotation)

    @property
    def _rotation(self) -> Floats:
        return np.asarray(rotation_matrices(self.turn[None])[0])


class CalmAlignment:
    """Places the shapes of an embedded pair.

    Parameters
    ----------
    embedding : Embedding
    surface : SurfacePath
        How the surface turns between the keys.
    turns : bool
        Whether there are full turns that the keys cannot tell: straight lines then tell nothing of the way, and nothing
        is placed.
    """

    def __init__(self, embedding: Embedding, surface: SurfacePath, turns: bool = False) -> None:
        self._embedding = embedding
        self._inner = (False, False)
        self._part = 0.0 if turns else _calm_part(embedding)
        self._course: Course | None = None
        self._led = 0.0
        self._weights = _weights(_calmness(embedding.travel), embedding)
        self._turning = _turning_part(surface, self._weights)

    def beside(self, inner: tuple[bool, bool]) -> CalmAlignment:
        """The same for a pair of a chain; ``inner`` tells which of its keys lies between it and another pair."""
        other = copy.copy(self)
        other._inner = inner
        return other

    def along(self, course: Course) -> CalmAlignment:
        """The same for a pair of a chain that follows a course, as far as that is followed."""
        other = copy.copy(self)
        areas = self._embedding.weights / self._embedding.weights.sum()
        other._course, other._led = course, float(areas @ course.share)
        calm = (1.0 - other._led) * _calmness(self._embedding.travel)
        other._weights = _weights(calm + other._led * course.share, self._embedding)
        return other

    def of(self, shape: Floats, time: float) -> RigidMove:
        """Where to carry a shape (n, 3) at ``time``, cube units."""
        if not self._part:
            return RigidMove(np.zeros(3), np.zeros(3), np.zeros(3))
        target = self._embedding.straight(time)
        if self._course is not None:
            target = self._course.lead(target, self._embedding, time)
        whole = RigidMove.between(shape, target, self._weights)
        onset, turning = (self._led + (1.0 - self._led) * part for part in (self.onset(time), self._turning))
        return whole.scaled(self._part * onset, turning)

    def onset(self, time: float) -> float:
        """The part of a move, 0..1, at ``time``; beside inner keys of a chain it sets in without a velocity."""
        before = 1.0 - (1.0 - time) ** _ONSET if self._inner[0] else 1.0
        after = 1.0 - time**_ONSET if self._inner[1] else 1.0
        return before * after


def _calm_part(embedding: Embedding) -> float:
    """How much of the alignment is due, 0..1: none where everything moves as one rigid body, which has no calm parts.

    Such a body moves along its screw, whose points near the axis are no calmer than they have to be.
    """
    left = np.linalg.norm(embedding.key1 - embedding.key0, axis=1) / embedding.scale
    way = np.linalg.norm(embedding.pair.key1 - embedding.pair.key0, axis=1)
    squares = [float(embedding.weights @ distance**2) for distance in (left, way)]
    share = float(np.sqrt(squares[0] / max(squares[1], 1e-300))) / _MOSTLY_RIGID
    return float(risen(share, _EXACTLY_RIGID, 1.0))


def _turning_part(surface: SurfacePath, weights: Floats) -> float:
    """How much of a rotation is due, 0..1, by how far what is calm, of weights (n,), turns between the keys."""
    deformation, turning = surface.deformation, surface.turning
    if not len(deformation.faces):
        return 1.0
    calm = sums_by_label(surface.group, weights)[deformation.faces].sum(axis=1) * deformation.weights
    angle = float(np.linalg.norm(calm @ (turning.swing + turning.twist))) / max(float(calm.sum()), 1e-300)
    return float(risen(angle, _TURNS_FAR, _TURNS_LITTLE))


def _calmness(travel: Floats) -> Floats:
    """(n,) in 0..1: most for the vertices that travel least; ``travel`` (n,) is relative to the size."""
    reach = float(np.percentile(travel, _CALM_PERCENTILE))
    return np.asarray(np.exp(-(np.minimum(travel / max(reach, 1e-300), 1e2) ** 2)))


def _weights(calmness: Floats, embedding: Embedding) -> Floats:
    """(n,) weights with sum 1: still vertices before all, then those with the most ``calmness`` (n,)."""
    still = (NEARLY_STILL / np.maximum(embedding.travel, STILL_TOLERANCE)) ** 4
    weights = (calmness + still) * embedding.weights
    return np.asarray(weights / weights.sum())
