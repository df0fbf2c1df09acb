# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Verdicts on pairs of keys: for which adding is right, and which need a combination; found without solving."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Bools, Floats
from ..numerics.grouped_sums import sums_by_label
from ..numerics.rotations import rotation_matrices
from ..triangles.closed_volume import ClosedComponents
from ..triangles.geometry import areas
from ..triangles.topology import sides, unique_edges
from .base import KeysOnBase
from .joint_crossings import JointCrossings
from .order import Bend, carries
from .volumes import volume_off_range

# Smallest visible differences, relative to the base's diagonal, to the lengths of edges, and to a volume.
_SEEN_DISTANCE, _SEEN_LENGTHS, _SEEN_VOLUME = 0.003, 0.02, 0.005
# Shorter edges, relative to the diagonal, and smaller volumes, relative to its cube, are not measured.
_SHORTEST, _SMALLEST = 1e-6, 1e-9
_PERCENTILE = 99.0  # of the edges that both keys move; a few worse ones are not seen


@dataclass(frozen=True)
class Verdict:
    """Verdict on whether the sum of two keys is right.

    Parameters
    ----------
    first, second : int
        Indices of the keys.
    outer : int
        The key, of these two, that carries the other one along.
    distance : float
        Estimated largest error of the sum, over the base's diagonal: how far the outer key's rotation moves the
        displacements of the inner key.
    lengths : float
        How far edge lengths in the sum are from what the keys' own changes add up to, over the base's lengths; 99th
        percentile of the edges that both keys move.
    volume : float
        How far the volume of a closed component is beyond what the keys' own changes explain, added or multiplied, over
        the base's volume; the worst component.
    crossings : int or None
        Number of pairs of triangles that cross in the sum but in neither key; None if the search was given up.
    """

    first: int
    second: int
    outer: int
    distance: float
    lengths: float
    volume: float
    crossings: int | None

    @property
    def adding_is_right(self) -> bool:
        """Whether the differences are too small to be seen."""
        seen = self.distance > _SEEN_DISTANCE and self.lengths > _SEEN_LENGTHS
        return not (seen or self.volume > _SEEN_VOLUME or self.crossings)

    @property
    def text(self) -> str:
        """The verdict in words, for the user."""
        if self.adding_is_right:
            return "adding is right"
        crossings = f", {self.crossings} crossings" if self.crossings else ""
        volume = f", volume {self.volume:.1%}" if self.volume > _SEEN_VOLUME else ""
        size = f"off by {self.distance:.1%} of the size, lengths by {self.lengths:.0%}"
        return f"needs a combination: {size}{volume}{crossings}"


def verdicts(keys: KeysOnBase, chosen: Sequence[tuple[int, int]] | None = None) -> Iterator[Verdict]:
    """Yield the verdict on each pair of keys, or on each of the ``chosen`` pairs of indices."""
    judge = _Judge(keys)
    for first, second in combinations(range(len(keys.pairs)), 2) if chosen is None else chosen:
        yield judge.of(first, second)


class _Judge:
    """Everything that the verdicts share, computed once."""

    def __init__(self, keys: KeysOnBase) -> None:
        self._keys = keys
        self._base = keys.scaled(keys.base)
        self._shapes = [keys.scaled(pair.key1) for pair in keys.pairs]
        self._still = keys.still[keys.vertices]
        reach = [np.linalg.norm(shape - self._base, axis=1) for shape in self._shapes]
        self._moves = [travel > _SHORTEST for travel in reach]
        self._bends = [Bend(keys, number) for number in range(len(keys.pairs))]
        self._edges = unique_edges(np.concatenate([sides(keys.faces), keys.edges]))
        self._lengths = [self._lengths_of(shape) for shape in (self._base, *self._shapes)]
        self._closed = ClosedComponents(keys.faces, keys.labels)
        self._volumes = [self._closed.volumes(shape) for shape in (self._base, *self._shapes)]
        self._crossings = JointCrossings(keys.faces, self._base, self._shapes, self._still)
        sizes = areas(self._base, keys.faces)
        self._around = [self._means(bend, sizes) for bend in self._bends]

    def of(self, first: int, second: int) -> Verdict:
        total = self._shapes[first] + self._shapes[second] - self._base
        fresh = self._crossings.fresh(total, (first, second))
        crossings = None if fresh is None else len(fresh)
        outer, inner = (first, second) if self._carries(first, second) else (second, first)
        both = self._moves[first] & self._moves[second]
        if not both.any():
            return Verdict(first, second, outer, 0.0, 0.0, 0.0, crossings)
        distance = self._turned(outer, inner)
        return Verdict(
            first, second, outer, distance, self._stretched(first, second, total, both),
            self._swollen(first, second, total), crossings,
        )  # fmt: skip

    def _carries(self, first: int, second: int) -> bool:
        one, other = self._bends[first], self._bends[second]
        points = carries(one, other)
        return points > 0.5 or (points == 0.5 and one.moved >= other.moved)

    def _turned(self, outer: int, inner: int) -> float:
        """Largest distance by which the outer key's rotation moves the inner key's displacements."""
        both = np.flatnonzero(self._moves[outer] & self._moves[inner])
        offsets = (self._shapes[inner] - self._base)[both]
        turned = np.einsum("nij,nj->ni", self._around[outer][both], offsets)
        return float(np.linalg.norm(turned - offsets, axis=1).max())

    def _means(self, bend: Bend, sizes: Floats) -> NDArray[np.float32]:
        """(k, 3, 3) mean rotation of the triangles around each vertex; the identity if there are none."""
        corners, count = self._keys.faces.ravel(), len(self._base)
        turns = np.repeat(sizes[:, None] * (rotation_matrices(bend.turns) - np.eye(3)).reshape(-1, 9), 3, axis=0)
        total = np.maximum(sums_by_label(corners, np.repeat(sizes, 3), count), 1e-300)
        means = np.eye(3) + (sums_by_label(corners, turns, count) / total[:, None]).reshape(-1, 3, 3)
        return np.asarray(means, dtype=np.float32)

    def _stretched(self, first: int, second: int, total: Floats, both: Bools) -> float:
        base = self._lengths[0]
        measured = both[self._edges].any(axis=1) & (base > _SHORTEST)
        if not measured.any():
            return 0.0
        wanted = np.abs(self._lengths[1 + first] + self._lengths[1 + second] - base)
        off = np.abs(self._lengths_of(total) - wanted)[measured] / base[measured]
        return float(np.percentile(off, _PERCENTILE))

    def _swollen(self, first: int, second: int, total: Floats) -> float:
        base = self._volumes[0]
        closed = np.abs(base) > _SMALLEST
        if not closed.any():
            return 0.0
        alone = [self._volumes[1 + first], self._volumes[1 + second]]
        off = volume_off_range(self._closed.volumes(total), base, alone)
        return float((np.abs(off)[closed] / np.abs(base[closed])).max())

    def _lengths_of(self, shape: Floats) -> Floats:
        return np.asarray(np.linalg.norm(shape[self._edges[:, 1]] - shape[self._edges[:, 0]], axis=1))
