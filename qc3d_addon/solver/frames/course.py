# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The course of a chain: one smooth curve for every vertex through all keys, which tells where parts are, and when.

Two keys tell how lengths turn and stretch between them. When a part is where, and how fast it goes through a key, is
told by the keys before and after. A cubic spline through the keys tells that, and it loses lengths, above all where
parts turn far. So frames are drawn to it in the large, the less the further the surface turns, and lengths decide the
rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..keys.embedding import Embedding
from ..numerics.rising import risen
from ..surface.end_rates import hermite

# On the anchors of what follows the course fully: parts longer than about a seventh of the size follow it, and lengths
# decide what is smaller. A tenth of it leaves the clips of docs/science/inbetweens.md twice as far from the course.
_STRENGTH = 1e6
# Turns between two keys, in radians: up to the first the course is followed fully, from the second on not at all.
_TURNS = (np.radians(60.0), np.radians(120.0))


@dataclass(frozen=True, eq=False)
class Course:
    """The curves between two keys of a chain.

    Parameters
    ----------
    key0, key1 : (n, 3)
    slopes : tuple of (n, 3) and (n, 3)
        Velocities at the two keys, per unit of the pair's own time.
    share : (n,)
        How much each vertex follows its curve, 0..1.
    """

    key0: Floats
    key1: Floats
    slopes: tuple[Floats, Floats]
    share: Floats

    def at(self, time: float) -> Floats:
        """(n, 3) places on the curves at ``time`` in 0..1, in the keys' coordinates."""
        way = self.key1 - self.key0
        bent = hermite(time, self.slopes[0] - way, self.slopes[1] - way)
        return np.asarray((1.0 - time) * self.key0 + time * self.key1 + bent)

    def lead(self, points: Floats, embedding: Embedding, time: float, share: Floats | None = None) -> Floats:
        """Points (n, 3) in the cube at ``time``, moved to the curves as far as each vertex follows its own."""
        part = (self.share if share is None else share)[:, None]
        return np.asarray(points + part * (embedding.to_cube(self.at(time), time) - points))

    @property
    def strength(self) -> Floats:
        """(n,) factors, at least 1, on the weights of the anchors."""
        return np.asarray(_STRENGTH**self.share)


def courses(keys: Floats, durations: Floats, still: Sequence[Bools], shares: Sequence[Floats]) -> list[Course]:
    """The courses of all pairs of a chain.

    Parameters
    ----------
    keys : (pairs + 1, n, 3)
    durations : (pairs,)
        Time that each pair takes, in any unit.
    still : sequence of (n,) bool
        For each pair, the vertices that do not move; they stand at both of its keys.
    shares : sequence of (n,)
        For each pair, how much the vertices follow the course, 0..1.
    """
    rests = np.zeros(keys.shape[:2], dtype=bool)
    for number, stands in enumerate(still):
        rests[number : number + 2] |= stands
    velocities = spline_velocities(keys, durations, rests)
    return [
        Course(
            keys[number],
            keys[number + 1],
            (duration * velocities[number], duration * velocities[number + 1]),
            shares[number],
        )
        for number, duration in enumerate(durations.tolist())
    ]


def spline_velocities(keys: Floats, durations: Floats, rests: Bools) -> Floats:
    """Velocities at the keys of cubic curves through them, which bend as little as possible at the first and the last.

    For pairs of equal duration this is the natural cubic spline, whose accelerations are continuous. For others, those
    accelerations agree that are measured in each pair's own time: a short pair beside a long one then does not
    make the long one overshoot, as it would with the natural spline.

    Parameters
    ----------
    keys : (k, n, 3)
        At least two.
    durations : (k - 1,)
        Positive.
    rests : (k, n) bool
        Where a vertex has no velocity.

    Returns
    -------
    (k, n, 3)

    Examples
    --------
    >>> line = np.array([0.0, 1.0, 4.0])[:, None, None] * np.ones((1, 1, 3))
    >>> spline_velocities(line, np.array([1.0, 3.0]), np.zeros((3, 1), dtype=bool))[:, 0, 0].round(12)
    array([1., 1., 1.])
    """
    last = len(keys) - 1
    before, after = np.append(0.0, durations), np.append(durations, 0.0)
    ways = np.diff(keys, axis=0, prepend=keys[:1], append=keys[-1:])
    # One equation for every key: before * v[-1] + 2 (before + after) * v + after * v[+1] = 3 (way before + way after).
    diagonal = np.where(rests, 1.0, 2.0 * (before + after)[:, None])
    lower, upper = (np.where(rests, 0.0, side[:, None]) for side in (before, after))
    load = np.where(rests[:, :, None], 0.0, 3.0 * (ways[:-1] + ways[1:]))
    for key in range(1, last + 1):
        factor = lower[key] / diagonal[key - 1]
        diagonal[key] -= factor * upper[key - 1]
        load[key] -= factor[:, None] * load[key - 1]
    velocities = np.empty_like(load)
    velocities[last] = load[last] / diagonal[last][:, None]
    for key in range(last - 1, -1, -1):
        velocities[key] = (load[key] - upper[key][:, None] * velocities[key + 1]) / diagonal[key][:, None]
    return velocities


def shares_of_turns(angles: Floats, weights: Floats, triangles: Ints, count: int) -> Floats:
    """How much vertices follow the course: fully where the surface around them turns little, not at all where far.

    Parameters
    ----------
    angles : (m,)
        Angles by which the triangles turn between the two keys, radians.
    weights : (m,)
        Positive weights of the triangles.
    triangles : (m, 3) int64
    count : int
        Number of vertices; those without a triangle follow fully.

    Returns
    -------
    (count,)
        In 0..1.
    """
    corners, each = triangles.ravel(), np.repeat(weights, 3)
    total = np.bincount(corners, each, count)
    mean = np.bincount(corners, each * np.repeat(angles, 3), count) / np.maximum(total, 1e-300)
    return np.asarray(1.0 - risen(mean, *_TURNS))
