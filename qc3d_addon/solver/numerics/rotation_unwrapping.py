# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwrapping of rotations over a mesh: angles beyond 180 degrees that agree between neighboring elements.

A rotation matrix determines its angle only up to full turns. Since neighboring elements turn by similar angles, the
branch of the rotation vector is propagated from element to element along a minimum spanning tree of the relative
rotations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints
from .grouped_sums import covariances_by_label, means_by_label, sums_by_label
from .rising import risen
from .rotation_forest import RotationForest, relative_angles
from .rotations import nearest_branch, products, rotation_matrices, rotation_vectors
from .torn_rotations import closed_tears

# Rotation vectors lose their axis at a full turn, 2 pi; a part that turns further than this gets a twist well before.
# Triangles count gradually from the first angle to the second.
_MOST_SWING = 1.5 * np.pi, 1.6 * np.pi
# Share of a part's weight that must turn further than that: a few badly shaped triangles must not decide for the part.
# The twist sets in gradually from the first share to the second.
_FAIR_SHARE = 0.01, 0.03
# Parts that turn by less than this short of half a turn, or beyond it, have two ways of about the same length.
_HALF_TURN = np.radians(30.0)
# Relative rotations of a loose part and the surface beside it, up to which the part is taken to be fixed there, like a
# button on a sleeve. Two wings beat in opposite directions: neither tells anything about the other.
_ALIKE = np.radians(60.0)
# Of several parts that are as large as the largest but for this, the first counts as that: rounding must not choose.
_AS_LARGE = 1e-3
_MEAN_STEPS = 30  # a cap: rotations that are spread all around may have no unique mean
_MEAN_FOUND = 1e-13  # radians; about the rounding of rotation vectors


@dataclass(frozen=True, eq=False)
class Turning:
    """Rotations of elements over time: R(t) = exp(t swing) exp(t twist).

    All elements of a part share the axis of the twist, whose angle is not limited; the swing is the remaining rotation.
    A part that turns by less than about three quarters of a turn has no twist.

    Parameters
    ----------
    swing, twist : (m, 3)
        Rotation vectors, radians.
    certainty : (m,), optional
        How certain it is which way round each element turns, 0..1; all 1 by default.
    """

    swing: Floats
    twist: Floats
    certainty: Floats | float = 1.0

    def at(self, time: float, change: Floats | float = 0.0) -> Floats:
        """(m, 3, 3) rotations at ``time`` in 0..1; ``change`` (m, 3) is added to the swing's rotation vector."""
        rotations = rotation_matrices(time * self.swing + change)
        if self.twist.any():
            rotations = products(rotations, rotation_matrices(time * self.twist))
        return rotations

    def part(self, chosen: Ints | slice) -> Turning:
        """The rotations of some of the elements."""
        swing = self.swing[chosen]
        return Turning(swing, self.twist[chosen] if self.twist.any() else no_twist(len(swing)))

    def other_way(self, chosen: Bools) -> Turning:
        """The same rotations at 1, to which the ``chosen`` elements (m,) turn the other way round."""
        if not chosen.any():
            return self
        angle = np.maximum(np.linalg.norm(self.swing, axis=1), 1e-300)[:, None]
        return Turning(np.where(chosen[:, None], self.swing * (1.0 - 2.0 * np.pi / angle), self.swing), self.twist)

    @property
    def angles(self) -> Floats:
        """(m,) angle by which each element turns in all, radians."""
        return self.angles_from(np.zeros(3))

    def angles_from(self, rest: Floats) -> Floats:
        """(m,) angle by which each element turns relative to the rotation vector ``rest`` (3,), radians."""
        return np.asarray(np.linalg.norm(self.swing + self.twist - rest, axis=1))


def consistent_turning(
    turns: Floats, adjacency: Ints, centers: Floats, weights: Floats, held: Bools, rest: Floats | None = None
) -> Turning:
    """Unwrap the rotations of all elements, so that neighbors agree, also beyond 180 and 360 degrees.

    Parameters
    ----------
    turns : (m, 3)
        Rotation vectors, radians, with angles in [0, pi].
    adjacency : (k, 2) int64
        Pairs of neighboring elements.
    centers : (m, 3)
        Centroids of the elements; they relate parts that are not connected.
    weights : (m,)
        Positive weights of the elements when the axis of their part is computed.
    held : (m,) bool
        Whether an element has a still vertex.
    rest : (3,), optional
        Rotation vector of what is still, where a motion of the whole was removed from everything.

    Notes
    -----
    The rotation vector of a neighbor is moved to the branch nearest to that of the element. This works up to a full
    turn, where the axis is lost. A part of which a fair share turns by more than ``_MOST_SWING`` is therefore split
    into a twist about its principal axis, whose angle is unwrapped like a phase and has no such limit, and a swing. At
    the limit, a part of the twist is split off, so that nothing changes at once.

    In each part the element that turns least takes the short way round; in a part with still vertices the one whose
    rotation is nearest to ``rest``. A part without still vertices that turns like the nearest element of the largest
    part, such as a button on a sleeve, takes its branch.
    """
    count = len(turns)
    if not count:
        return Turning(turns.copy(), turns.copy())
    forest = RotationForest(turns, adjacency)
    loose = ~np.isin(forest.labels, forest.labels[held])
    started, angles = turns, np.linalg.norm(turns, axis=1)
    if rest is not None and rest.any():
        resting = np.broadcast_to(rest, turns.shape)
        angles = np.where(loose, angles, relative_angles(turns, resting))
        rests = ~loose & (angles < 0.5 * np.pi)
        started = np.where(rests[:, None], nearest_branch(turns, resting), turns)
    forest = forest.rooted(angles)
    vectors = _agreeing_parts(forest, forest.carried(started, nearest_branch), centers, weights, loose)
    vectors, certainty = closed_tears(forest, vectors, turns, adjacency)
    axes = _principal_axes(vectors, weights, forest.labels)[forest.labels]
    half = 0.5 * np.linalg.norm(turns, axis=1)
    sine_along = 0.5 * np.sinc(half / np.pi) * np.einsum("ki,ki->k", turns, axes)
    phases = forest.carried(2.0 * np.arctan2(sine_along, np.cos(half)), _nearest_phase)
    farthest = np.maximum(np.abs(phases), np.linalg.norm(vectors, axis=1))
    share = sums_by_label(forest.labels, weights * risen(farthest, *_MOST_SWING))
    degree = risen(share / sums_by_label(forest.labels, weights), *_FAIR_SHARE)[forest.labels]
    if not degree.any():
        return Turning(vectors, no_twist(count), certainty)
    twist = (degree * phases)[:, None] * axes
    swing = swing_beside(turns, twist)
    partly = (degree < 1.0)[:, None]
    swing = np.where(partly, nearest_branch(swing, (1.0 - degree)[:, None] * vectors), swing)
    return Turning(swing, twist, certainty)


def no_twist(count: int) -> Floats:
    """(count, 3) zeros, which take no memory."""
    return np.broadcast_to(np.zeros(3), (count, 3))


def half_turned(turning: Turning, weights: Floats, labels: Ints, rest: Floats) -> Ints:
    """The parts whose elements turn, on average, by about half a turn, by whose numbers ``labels`` (m,) call them.

    Parameters
    ----------
    turning : Turning
    weights : (m,)
        Positive weights of the elements.
    labels : (m,) int64
        Part of every element.
    rest : (3,)
        Rotation vector of what does not turn.
    """
    mean = np.linalg.norm(means_by_label(labels, turning.swing - rest, weights), axis=1)
    twisted = sums_by_label(labels, turning.twist.any(axis=1).astype(np.float64)) > 0.0
    return np.flatnonzero((np.abs(mean - np.pi) < _HALF_TURN) & ~twisted)


def mean_turns(turning: Turning, weights: Floats, labels: Ints, count: int) -> Floats:
    """(count, 3) weighted mean of each part's rotation vectors, radians; not a number where a part has no elements.

    Parameters
    ----------
    turning : Turning
    weights : (m,)
        Positive weights of the elements.
    labels : (m,) int64
        Part of every element.
    count : int
        Number of parts.
    """
    means = means_by_label(labels, turning.swing + turning.twist, weights, count)
    means[np.bincount(labels, minlength=count) == 0] = np.nan
    return means


def mean_turn(turns: Floats, adjacency: Ints, weights: Floats) -> Floats:
    """Rotation vector (3,), angle in [0, pi], of the Karcher mean of unwrapped rotations.

    Relative to the Karcher mean, the weighted rotation vectors of the elements sum to zero. They are unwrapped relative
    to the mean in every iteration. So two ends that are twisted by more than half a turn in opposite directions cancel
    out, where a least-squares fit of the positions would leave the rotation undetermined.

    Parameters
    ----------
    turns : (m, 3)
        Rotation vectors, radians, with angles in [0, pi]; at least one.
    adjacency : (k, 2) int64
        Pairs of neighboring elements.
    weights : (m,)
        Weights of the elements, not all zero.

    References
    ----------
    Karcher, "Riemannian center of mass and mollifier smoothing", 1977.
    """
    forest = RotationForest(turns, adjacency)
    rotations = rotation_matrices(turns)
    shares = weights / weights.sum()
    mean = np.eye(3)
    for _ in range(_MEAN_STEPS):
        beside = rotation_vectors(mean.T @ rotations)
        rooted = forest.rooted(np.linalg.norm(beside, axis=1))
        step = shares @ closed_tears(rooted, rooted.carried(beside, nearest_branch), beside, adjacency)[0]
        mean = mean @ rotation_matrices(step[None])[0]
        if np.linalg.norm(step) < _MEAN_FOUND:
            break
    return np.asarray(rotation_vectors(mean[None])[0])


def _agreeing_parts(forest: RotationForest, vectors: Floats, centers: Floats, weights: Floats, loose: Bools) -> Floats:
    """Rotation vectors (m, 3) with every loose part that turns like the largest part beside it on the same branch."""
    sizes = sums_by_label(forest.labels, weights)
    largest = forest.labels == np.argmax(sizes >= (1.0 - _AS_LARGE) * sizes.max())
    others = forest.roots[~largest[forest.roots] & loose[forest.roots]]
    if not len(others):
        return vectors
    nearest = np.flatnonzero(largest)[cKDTree(centers[largest]).query(centers[others])[1]]
    alike = relative_angles(vectors[others], vectors[nearest]) < _ALIKE
    others, nearest = others[alike], nearest[alike]
    started = vectors.copy()
    started[others] = nearest_branch(vectors[others], vectors[nearest])
    return forest.carried(started, nearest_branch)


def swing_beside(turns: Floats, twist: Floats) -> Floats:
    """(m, 3) rotation vectors, angles in [0, pi], of the swing R exp(-twist) of rotations R given as vectors (m, 3)."""
    return rotation_vectors(rotation_matrices(turns) @ rotation_matrices(-twist))


def _nearest_phase(phases: Floats, references: Floats) -> Floats:
    return np.asarray(phases + 2.0 * np.pi * np.round((references - phases) / (2.0 * np.pi)))


def _principal_axes(vectors: Floats, weights: Floats, labels: Ints) -> Floats:
    """(parts, 3) unit axis about which each part turns most, oriented along its mean rotation."""
    axes = np.linalg.eigh(covariances_by_label(labels, weights[:, None] * vectors, vectors))[1][:, :, 2]
    along = sums_by_label(labels, weights * np.einsum("ki,ki->k", vectors, axes[labels]))
    return np.asarray(axes * np.where(along < 0.0, -1.0, 1.0)[:, None])
