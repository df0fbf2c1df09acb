# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths take precedence over enclosed volumes.

A skin can gain or lose volume by bending, which hardly changes its lengths. A box can do so only by stretching its
sides. So a box that is stretched along one axis in the first key and along another in the second rightly has more
volume in between than in both keys.
"""

from __future__ import annotations

import copy

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import means_by_label
from ..numerics.rising import risen
from ..triangles.closed_volume import ClosedComponents
from ..triangles.deformation import pressed_shares
from ..triangles.geometry import edge_lengths
from ..triangles.topology import sides, unique_edges

# How far edges may leave the interval between their key lengths for the sake of a component's volume, relative; 99th
# percentile. It is too small to be seen, and real pairs need up to 0.0015.
_MOST_EXCESS = 0.002
_PERCENTILE = 0.99
# An edge that leaves the interval by more suffers in the straight blend.
_SUFFERS = 0.01
# Relative volume corrections below the first never cost so much: even if everything must stretch, lengths change by a
# third. From the second on they are looked at fully; in between gradually, so that motions have no corner there.
_SMALL_CORRECTION, _LARGE_CORRECTION = 0.005, 0.01
_SHORTEST = 1e-9  # cube units
# Where from the first part of a component's surface on up to the second is pressed flat, nothing tells any more how it
# turns; it goes straight if that keeps its lengths.
_PRESSED = 0.02, 0.2
# Of a component's volume: nor is more of it given up on a way of its own than straight lines would cost.
_MOST_LOST = 0.002


class LengthsFirst:
    """Blends, for each component, a shape that keeps its volume with one that does not.

    Parameters
    ----------
    key0, key1 : (n, 3)
        Positions in the two keys, cube units.
    covering : tuple of (m, 3) int64 and (m,)
        Triangles that cover the surface evenly, and what each counts.
    springs : (s, 2) int64
        Further edges of the mesh.
    labels : (n,) int64
        Component of each vertex.
    closed : ClosedComponents
        Those that enclose a volume. One that is mirrored or turned inside out from one key to the other goes straight,
        since no motion of its own leads there.
    halfway : (n, 3)
        The middle of the straight lines between the keys before the motion of the whole was taken out, cube units.
    free : (n,) bool
        Vertices that may move even if both keys leave them in place.
    """

    def __init__(
        self,
        key0: Floats,
        key1: Floats,
        covering: tuple[Ints, Floats],
        springs: Ints,
        labels: Ints,
        closed: ClosedComponents,
        halfway: Floats,
        free: Bools,
    ) -> None:
        triangles, shares = covering
        edges = unique_edges(np.concatenate([sides(triangles), springs]))
        ends = [edge_lengths(key, edges) for key in (key0, key1)]
        usable = np.minimum(*ends) > _SHORTEST
        counts = np.bincount(labels[edges[usable, 0]], minlength=int(labels.max(initial=-1)) + 1)
        moving = (key0 != key1).any(axis=1)
        # Edges that stay in place keep their lengths.
        usable &= (moving | free)[edges].any(axis=1)
        self._edges = edges[usable]
        self._shortest, self._longest = np.minimum(*ends)[usable], np.maximum(*ends)[usable]
        self._moving = moving[self._edges].any(axis=1)
        self._labels = labels
        self._key0, self._key1 = key0, key1
        self._label = labels[self._edges[:, 0]]
        self._closed, self._volumes = closed, [closed.volumes(key) for key in (key0, key1)]
        self._reversal = closed.reversal(key0, key1)
        self._pressed = risen(pressed_shares(key0, key1, triangles, shares, labels), *_PRESSED)
        self._straight_share = np.ones(len(self._reversal))
        self._is_one = np.count_nonzero(counts) == 1
        # Of each component, how many edges lie beyond its percentile.
        self._beyond = counts - 1 - np.ceil(_PERCENTILE * (counts - 1)).astype(np.int64)
        self._counts = np.maximum(counts, 1)
        # Of each component, how far the straight blend may be gone along: not at all where any edge suffers half-way.
        worst = np.zeros(len(counts))
        np.maximum.at(worst, self._label, self._excesses(0.5 * (key0 + key1)))
        self._can_go_straight = np.clip((_SUFFERS - worst) / (_SUFFERS - _MOST_EXCESS), 0.0, 1.0)
        self._can_go_straight[np.bincount(labels, weights=moving) == 0] = 0.0
        # Beside a key all lines keep lengths; those that lose them half-way are no way at all.
        self._can_follow_lines = _tolerable(self._excess(self._excesses(halfway)))

    def mixed(self, held: Floats, free: Floats, time: float) -> Floats:
        """(n, 3) blend of shapes with (``held``) and without kept volumes, as close to the former as lengths allow.

        Lengths may be as bad as without kept volumes, or as in the straight blend at ``time``, and a little worse.
        """
        straight = (1.0 - time) * self._key0 + time * self._key1
        held_excess, *others = (self._excess(self._excesses(one)) for one in (held, free, straight))
        added = held_excess - np.maximum(*others)
        part = _allowed(added)
        return np.asarray(free + part[self._labels][:, None] * (held - free))

    def beside_course(self, shares: Floats) -> LengthsFirst:
        """The same for vertices that follow another course than straight lines, as far as ``shares`` (n,) in 0..1."""
        other = copy.copy(self)
        other._straight_share = 1.0 - means_by_label(self._labels, shares[:, None], count=len(self._reversal))[:, 0]
        return other

    def straightened(self, shape: Floats, time: float, lines: Floats) -> Floats:
        """(n, 3) a shape whose components go straighter where their own way costs lengths that the straight one keeps.

        Where all edges of a component keep between their key lengths in the straight blend, as those of what is
        flattened do, it is as good a way as any, and better where it also keeps the volume. Nor may edges suffer more
        on average than they do there. The same goes for the straight ``lines`` (n, 3) between the keys before the
        motion of the whole was taken out: those of something that is sheared keep its lengths, although they turn it.
        """
        straight = (1.0 - time) * self._key0 + time * self._key1
        excesses = self._excesses(shape)
        worse = self._mean_excess(excesses) - self._mean_excess(self._excesses(straight))
        need = np.maximum((1.0 - _allowed(worse)) * self._straight_share, self._reversal)
        can_go_straight = self._can_go_straight * self._straight_share
        excess = self._excess(excesses)
        if can_go_straight.any():
            costs = np.maximum(1.0 - _allowed(excess), self._pressed)
            costs = np.maximum(costs, 1.0 - _tolerable(self._lost_volume(shape, straight, time), _MOST_LOST))
            need = np.maximum(need, costs * can_go_straight)
        if need.any():
            shape = shape + need[self._labels][:, None] * (straight - shape)
            excess = self._excess(self._excesses(shape))
        costs = (1.0 - _allowed(excess)) * self._can_follow_lines * self._straight_share
        if costs.any():
            costs *= _tolerable(self._excess(self._excesses(lines)))
            shape = shape + costs[self._labels][:, None] * (lines - shape)
        return shape

    def _lost_volume(self, shape: Floats, straight: Floats, time: float) -> Floats:
        """(components,) by how much more a shape misses the interpolated volume than the straight one, relative."""
        wanted = (1.0 - time) * self._volumes[0] + time * self._volumes[1]
        missed = [np.abs(self._closed.volumes(positions) - wanted) for positions in (shape, straight)]
        largest = np.maximum(*np.abs(self._volumes))
        return np.where(largest > 0.0, (missed[0] - missed[1]) / np.where(largest > 0.0, largest, 1.0), 0.0)

    def lost(self, shape: Floats) -> float:
        """99th percentile of how far the edges that move leave the interval between their key lengths, relative."""
        excess = self._excesses(shape)[self._moving]
        return float(np.percentile(excess, 100.0 * _PERCENTILE)) if len(excess) else 0.0

    def _mean_excess(self, excesses: Floats) -> Floats:
        """(components,) mean over its edges of the excesses (e,)."""
        return np.asarray(np.bincount(self._label, weights=excesses, minlength=len(self._counts)) / self._counts)

    def _excess(self, excesses: Floats) -> Floats:
        """(components,) 99th percentile of the excesses (e,) of its edges."""
        # Most edges have none: only the others are sorted.
        some = np.flatnonzero(excesses)
        label, values = self._label[some], excesses[some]
        ends = np.cumsum(np.bincount(label, minlength=len(self._counts)))
        places = ends - 1 - self._beyond
        reached = (self._beyond >= 0) & (places >= np.append(0, ends[:-1]))
        found = np.zeros(len(self._counts))
        if reached.any():
            places = places[reached]
            if self._is_one:  # sorting all edges would take as long as a sweep
                found[reached] = np.partition(values, places)[places]
            else:
                found[reached] = values[np.lexsort((values, label))][places]
        return found

    def _excesses(self, shape: Floats) -> Floats:
        """(e,) how far each edge leaves the interval of its key lengths."""
        length = edge_lengths(shape, self._edges)
        return np.asarray(
            np.maximum(np.maximum(length / self._longest, 2.0 - length / self._shortest) - 1.0, 0.0)
        )


def onset_of_mixing(corrected: Floats) -> Floats:
    """(q,) how far shapes are mixed, 0..1, whose volumes had to be corrected by parts (q,) of them."""
    return risen(corrected, _SMALL_CORRECTION, _LARGE_CORRECTION)


def _allowed(excess: Floats) -> Floats:
    """(c,) the part, 0..1, by which an excess stays below the largest; without a corner where that sets in."""
    # The reduced excess is at most 4/3 of where the reduction sets in.
    beyond = np.maximum(excess / (0.75 * _MOST_EXCESS) - 1.0, 0.0)
    return np.asarray(1.0 / (1.0 + beyond**2 / (1.0 + beyond)))


def _tolerable(excess: Floats, most: float = _MOST_EXCESS) -> Floats:
    """(c,) 1 where there is no excess, a quarter at the largest, falling without a corner."""
    beyond = np.maximum(excess, 0.0) / most
    return np.asarray(1.0 / (1.0 + beyond**2) ** 2)
