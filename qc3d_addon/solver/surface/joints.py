# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps loose parts together where they lie close to each other in both keys, like a wing beside its body.

Rotations and lengths tell nothing about where a part is that no edge connects to another. Of such a part, the points
that lie close to another part in both keys, its joint, keep their distance from that part on the way.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import means_by_label, sums_by_label
from ..numerics.rotations import rotation_matrices

# A joint's points are no further apart, in both keys together, than this part of the size of the smaller component.
_REACH = 0.15
# Points of a component that are looked at: enough to find joints, few enough to compare all.
_MOST_POINTS = 200
# How strongly joints hold against the place that a component has of its own: a full joint leaves a thousandth.
_HOLD, _SOFTEST = 10.0, 0.01
# Of the size: components that travel less than this resist alike.
_CALM = 0.01


class Joints:
    """Moves each component of a surface, without turning it, to where its joints with other components stay closed.

    Components with still vertices keep their place. Components that travel less follow less.

    Parameters
    ----------
    key0, key1 : (n, 3)
    still : (n,) bool
    weights : (n,)
        Positive weights of the vertices: areas.
    labels : (n,) int64
        Component of every vertex.
    turns : (components, 3)
        Rotation vectors of the components from the first key to the second, radians; not finite where there is none.
    """

    def __init__(self, key0: Floats, key1: Floats, still: Bools, weights: Floats, labels: Ints, turns: Floats) -> None:
        count = len(turns)
        self._labels, self._count = labels, count
        held = np.bincount(labels, weights=still, minlength=count) > 0
        pairs, closeness = _close_points(key0, key1, labels, held)
        self._pairs = pairs
        if not len(pairs):
            return
        parts = labels[pairs]
        told = np.where(np.isfinite(turns), turns, 0.0)
        self._turns = told[parts].mean(axis=1)
        offsets = [key[pairs[:, 1]] - key[pairs[:, 0]] for key in (key0, key1)]
        self._first = offsets[0]
        self._change = np.einsum("kij,kj->ki", rotation_matrices(-self._turns), offsets[1]) - offsets[0]
        # All points of two components form one joint, whose strength grows with their number and closeness.
        joint = np.unique(parts.min(axis=1) * count + parts.max(axis=1), return_inverse=True)[1].ravel()
        total = sums_by_label(joint, closeness)[joint]
        strength = 1.0 - np.exp(-total)
        travel = means_by_label(labels, ((key1 - key0) ** 2).sum(axis=1)[:, None], weights, count)[:, 0]
        size = float(np.ptp(key0, axis=0).max())
        masses = sums_by_label(labels, weights, count) / ((_CALM * size) ** 2 + travel)
        hold = _HOLD * strength / (1.0 + _SOFTEST - strength) * masses[parts].min(axis=1)
        self._holds = hold * closeness / total
        rows, columns = parts.ravel(), parts[:, ::-1].ravel()
        doubled = np.repeat(self._holds, 2)
        laplacian = diags_array(sums_by_label(rows, doubled, count) + masses) - csc_array(
            (doubled, (rows, columns)), shape=(count, count)
        )
        self._free: Ints = np.flatnonzero(~held)
        self._factors = splu(csc_array(csc_array(laplacian)[self._free][:, self._free]))

    def closed(self, shape: Floats, time: float) -> Floats:
        """The shape (n, 3) at ``time``, in [0, 1], with its components moved so that their joints stay closed."""
        if not len(self._pairs):
            return shape
        rotations = rotation_matrices(time * self._turns)
        wanted = np.einsum("kij,kj->ki", rotations, self._first + time * self._change)
        missing = shape[self._pairs[:, 1]] - shape[self._pairs[:, 0]] - wanted
        pull = self._holds[:, None] * missing
        moves = np.zeros((self._count, 3))
        load = sums_by_label(self._labels[self._pairs].T.ravel(), np.concatenate([pull, -pull]), len(moves))
        moves[self._free] = self._factors.solve(load[self._free])
        return np.asarray(shape + moves[self._labels])


def _close_points(key0: Floats, key1: Floats, labels: Ints, held: Bools) -> tuple[Ints, Floats]:
    """(k, 2) vertices of different components that lie close to each other in both keys, and how close they are, 0..1.

    At least one of the components is free to move, that is, not ``held`` (components,).
    """
    none = np.empty((0, 2), dtype=np.int64), np.empty(0)
    count = len(held)
    if count < 2 or held.all():
        return none
    spread = np.linalg.norm(key0 - means_by_label(labels, key0, count=count)[labels], axis=1)
    reach = np.zeros(count)
    np.maximum.at(reach, labels, 2.0 * _REACH * spread)
    chosen = _some_of_each(labels, count)
    both = np.concatenate([key0, key1], axis=1)[chosen]
    tree = cKDTree(both)
    near = tree.query_ball_point(both, reach[labels[chosen]])
    first = np.repeat(np.arange(len(chosen)), [len(found) for found in near])
    second = np.concatenate([np.asarray(found, dtype=np.int64) for found in near])
    pairs = chosen[np.stack([first, second], axis=1)]
    parts = labels[pairs]
    # Seen from the smaller component, whose reach counts, and once only.
    own, other = parts.T
    smaller = (reach[own] < reach[other]) | ((reach[own] == reach[other]) & (own < other))
    kept = smaller & ~held[parts].all(axis=1)
    pairs, own = pairs[kept], own[kept]
    if not len(pairs):
        return none
    distance = np.sqrt(sum(((key[pairs[:, 0]] - key[pairs[:, 1]]) ** 2).sum(axis=1) for key in (key0, key1)))
    closeness = np.maximum(1.0 - (distance / reach[own]) ** 2, 0.0) ** 2
    close = closeness > 0.0
    return pairs[close], closeness[close]


def _some_of_each(labels: Ints, count: int) -> Ints:
    """Some vertices of each component, evenly by number."""
    order = np.argsort(labels, kind="stable")
    sizes = np.bincount(labels, minlength=count)
    place = np.arange(len(labels)) - (np.cumsum(sizes) - sizes)[labels[order]]
    step = -(-sizes // _MOST_POINTS)
    return np.asarray(np.sort(order[place % step[labels[order]] == 0]))
