# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Consistent branches of rotation vectors over a mesh: turns beyond 180 degrees, and neighbours that agree.

The rotation of one element tells its angle only up to full turns. Neighbouring elements turn alike, so the branch is
carried from element to element along a spanning tree that crosses the smallest relative rotations first.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints
from .grouped_sums import covariances_by_label, sums_by_label
from .rotations import nearest_branch, products, rotation_matrices, rotation_vectors

_MOST_SWING = 1.55 * np.pi
_FAIR_SHARE = 0.02
_DIGITS = 9
_MEAN_STEPS = 30
_MEAN_FOUND = 1e-13  # radians


@dataclass(frozen=True, eq=False)
class Turning:
    """How elements turn with time: R_t = exp(t swing) exp(t twist).

    The twist is about one axis for a whole part of the surface and of any number of turns; the swing is what is left.
    A part that turns less has no twist, its swing is the whole rotation.

    Parameters
    ----------
    swing, twist : (m, 3)
        Rotation vectors, radians.
    """

    swing: Floats
    twist: Floats

    def at(self, time: float, change: Floats | float = 0.0) -> Floats:
        """(m, 3, 3) rotations at ``time`` in 0..1; ``change`` (m, 3) is added to the swing's rotation vector."""
        rotations = rotation_matrices(time * self.swing + change)
        if self.twist.any():
            rotations = products(rotations, rotation_matrices(time * self.twist))
        return rotations

    @property
    def angles(self) -> Floats:
        """(m,) how far each element turns, radians."""
        return self.angles_from(np.zeros(3))

    def angles_from(self, rest: Floats) -> Floats:
        """(m,) how far each element turns beside what turns by ``rest`` (3,), a rotation vector in radians."""
        parts = (self.swing, self.twist) if self.twist.any() else (self.swing - rest,)
        return np.asarray(np.max([np.linalg.norm(part, axis=1) for part in parts], axis=0))


def consistent_turning(
    turns: Floats, adjacency: Ints, centres: Floats, weights: Floats, held: Bools, rest: Floats
) -> Turning:
    """Turn every element so that neighbours agree, beyond 180 degrees and beyond 360 where they do.

    Parameters
    ----------
    turns : (m, 3)
        Rotation vectors, angles in [0, pi].
    adjacency : (k, 2) int64
        Pairs of neighbouring elements.
    centres : (m, 3)
        Where the elements are, for parts that hang together with nothing.
    weights : (m,)
        What elements count in the axis of their part.
    held : (m,) bool
        Elements that touch what both keys leave in place.
    rest : (3,)
        Rotation vector of what both keys leave in place: nothing, unless a motion of the whole was taken out.

    Notes
    -----
    The rotation vector of an element is followed to its neighbours by the nearest branch, which is right up to a full
    turn: there the axis is lost. A part of which a fair share turns by more than ``_MOST_SWING`` is therefore split
    into a twist about its principal axis, whose angle is unwrapped like a phase and has no such limit, and a swing.

    Within a part the element that turns least, or most nearly as what rests where something holds the part, goes the
    short way round. A part that nothing holds, such as a button on a sleeve, goes the way that the surface of the
    largest part does where it is nearest.
    """
    count = len(turns)
    if not count:
        return Turning(turns.copy(), turns.copy())
    forest = _Forest(turns, adjacency)
    loose = ~np.isin(forest.labels, forest.labels[held])
    resting = np.where(loose[:, None], 0.0, rest)
    forest = forest.rooted(_relative_angles(turns, resting))
    started = np.where(loose[:, None], turns, nearest_branch(turns, resting)) if rest.any() else turns
    vectors = _agreeing_parts(forest, forest.carried(started, nearest_branch), centres, loose)
    axes = _principal_axes(vectors, weights, forest.labels)[forest.labels]
    half = 0.5 * np.linalg.norm(turns, axis=1)
    sine_along = 0.5 * np.sinc(half / np.pi) * np.einsum("ki,ki->k", turns, axes)
    phases = forest.carried(2.0 * np.arctan2(sine_along, np.cos(half)), _nearest_phase)
    far = np.maximum(np.abs(phases), np.linalg.norm(vectors, axis=1)) > _MOST_SWING
    share = sums_by_label(forest.labels, weights * far) / sums_by_label(forest.labels, weights)
    twists = (share > _FAIR_SHARE)[forest.labels]
    twist = np.where(twists[:, None], phases[:, None] * axes, 0.0)
    return Turning(np.where(twists[:, None], swing_beside(turns, twist), vectors), twist)


def mean_turn(turns: Floats, adjacency: Ints, weights: Floats) -> Floats:
    """Rotation vector (3,), the short way round, of the mean of rotations that are unwrapped about it.

    The Karcher mean: the rotation beside which the turns of the elements add up to nothing. Beside it every part is
    unwrapped from its element that turns least, so that ends twisted by more than half a turn either way cancel out,
    where the best fit of positions would be a tie between all directions.

    Parameters
    ----------
    turns : (m, 3)
        Rotation vectors, angles in [0, pi]; at least one.
    adjacency : (k, 2) int64
        Pairs of neighbouring elements.
    weights : (m,)
        What elements count; positive somewhere.

    References
    ----------
    Karcher, "Riemannian center of mass and mollifier smoothing", 1977.
    """
    forest = _Forest(turns, adjacency)
    rotations = rotation_matrices(turns)
    shares = weights / weights.sum()
    mean = np.eye(3)
    for _ in range(_MEAN_STEPS):
        beside = rotation_vectors(mean.T @ rotations)
        rooted = forest.rooted(np.linalg.norm(beside, axis=1))
        step = shares @ rooted.carried(beside, nearest_branch)
        mean = mean @ rotation_matrices(step[None])[0]
        if np.linalg.norm(step) < _MEAN_FOUND:
            break
    return np.asarray(rotation_vectors(mean[None])[0])


def _agreeing_parts(forest: _Forest, vectors: Floats, centres: Floats, loose: Bools) -> Floats:
    """Rotation vectors (m, 3) with every loose part in the branch that is nearest to the largest part's."""
    largest = forest.labels == np.argmax(np.bincount(forest.labels))
    others = forest.roots[~largest[forest.roots] & loose[forest.roots]]
    if not len(others):
        return vectors
    nearest = np.flatnonzero(largest)[cKDTree(centres[largest]).query(centres[others])[1]]
    started = vectors.copy()
    started[others] = nearest_branch(vectors[others], vectors[nearest])
    return forest.carried(started, nearest_branch)


def swing_beside(turns: Floats, twist: Floats) -> Floats:
    """(m, 3) rotation vectors of what rotations (m, 3) are beside a twist (m, 3), the short way round."""
    return rotation_vectors(rotation_matrices(turns) @ rotation_matrices(-twist))


def _nearest_phase(phases: Floats, references: Floats) -> Floats:
    return np.asarray(phases + 2.0 * np.pi * np.round((references - phases) / (2.0 * np.pi)))


def _principal_axes(vectors: Floats, weights: Floats, labels: Ints) -> Floats:
    """(parts, 3) unit axes about which the parts turn most, pointing the way in which they turn."""
    axes = np.linalg.eigh(covariances_by_label(labels, weights[:, None] * vectors, vectors))[1][:, :, 2]
    along = sums_by_label(labels, weights * np.einsum("ki,ki->k", vectors, axes[labels]))
    return np.asarray(axes * np.where(along < 0.0, -1.0, 1.0)[:, None])


class _Forest:
    """A spanning tree of each connected part, over the smallest relative rotations."""

    def __init__(self, turns: Floats, adjacency: Ints) -> None:
        count = len(turns)
        first, second = adjacency.T.astype(np.int32)  # scipy before 1.16 takes no others
        # A relative rotation of zero must still count as an edge of the graph; which of several alike are taken must
        # not depend on rounding.
        cost = np.round(_relative_angles(turns[first], turns[second]), _DIGITS) + 10.0**-_DIGITS
        tree = minimum_spanning_tree(coo_array((cost, (first, second)), shape=(count, count)).tocsr())
        self.labels: Ints = np.asarray(connected_components(tree, directed=False)[1], dtype=np.int64)
        self._edges: list[Ints] = [end.astype(np.int64) for end in tree.nonzero()]

    def rooted(self, angles: Floats) -> _Forest:
        """The same trees, each rooted where the angles (m,) are smallest."""
        other = copy.copy(self)
        other._root(angles)
        return other

    def _root(self, angles: Floats) -> None:
        count, labels = len(angles), self.labels
        by_angle = np.lexsort((np.round(angles, _DIGITS), labels))
        self.roots: Ints = by_angle[np.searchsorted(labels[by_angle], np.arange(labels.max() + 1))]
        # One more node joins all roots, so that one search covers every part.
        rows, columns = self._edges
        rows = np.concatenate([rows, np.full(len(self.roots), count)])
        columns = np.concatenate([columns, self.roots])
        joined = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1)).tocsr()
        order, self._parents = (found.astype(np.int64) for found in breadth_first_order(joined, count, directed=False))
        depth = _depths(order, self._parents)
        self._by_depth = order[np.argsort(depth[order], kind="stable")]
        self._starts = np.searchsorted(depth[self._by_depth], np.arange(2, depth.max() + 2))

    def carried(self, values: Floats, align: Callable[[Floats, Floats], Floats]) -> Floats:
        """Walk outwards from the roots, a generation at a time, aligning each value with its parent's."""
        result = values.copy()
        for begin, end in pairwise(self._starts):
            members = self._by_depth[begin:end]
            result[members] = align(values[members], result[self._parents[members]])
        return result


def _depths(order: Ints, parents: Ints) -> Ints:
    """Distance from the root of every node of a breadth-first order, by pointer doubling."""
    ancestor = parents.copy()
    ancestor[order[0]] = order[0]
    depth = np.ones(len(parents), dtype=np.int64)
    depth[order[0]] = 0
    while True:
        further = depth[ancestor]
        if not further.any():
            return depth
        depth = depth + further
        ancestor = ancestor[ancestor]


def _relative_angles(first: Floats, second: Floats) -> Floats:
    """(k,) angles between the rotations of two lists of rotation vectors, from their quaternions."""
    scalars, vectors = zip(*(_half_angle(vector) for vector in (first, second)), strict=True)
    inner = scalars[0] * scalars[1] + np.einsum("ki,ki->k", vectors[0], vectors[1])
    return np.asarray(2.0 * np.arccos(np.clip(np.abs(inner), 0.0, 1.0)))


def _half_angle(vectors: Floats) -> tuple[Floats, Floats]:
    half = 0.5 * np.linalg.norm(vectors, axis=1)
    return np.cos(half), 0.5 * np.sinc(half / np.pi)[:, None] * vectors
