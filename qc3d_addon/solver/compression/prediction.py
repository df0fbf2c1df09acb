# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole numbers at points, told by how far each is from what its neighbors say; coarse points first, then between.

All of it is whole numbers, so that every machine predicts the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints

BITS = 20  # of a coordinate, over the size of the points
_NEIGHBORS = 4
_CANDIDATES = 16  # nearest points; those that count are chosen among them exactly
_WEIGHT_BITS = 10


class Predictor:
    """The order of points, and who predicts whom.

    Parameters
    ----------
    points : (n, 3)
        Where the numbers belong; what reads them must have the same points.
    """

    def __init__(self, points: Floats) -> None:
        lattice = lattice_of(points)
        along = along_curve(lattice)
        levels = levels_along(along)
        self.order = np.lexsort((along, levels))
        self._steps = []
        for level in range(1, int(levels.max(initial=0)) + 1):
            known, wanted = np.flatnonzero(levels < level), np.flatnonzero(levels == level)
            if len(wanted):
                self._steps.append((wanted, *_neighbors(lattice, known, wanted)))

    def differences(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """(n, c) residuals of numbers (n, c) after the prediction, in the order of coding."""
        left = numbers.copy()
        for wanted, neighbors, weights in self._steps:
            left[wanted] -= _predicted(numbers[neighbors], weights)
        return np.asarray(left[self.order])

    def numbers(self, differences: NDArray[np.int64]) -> NDArray[np.int64]:
        """(n, c) the numbers that have these differences."""
        numbers = np.empty_like(differences)
        numbers[self.order] = differences
        for wanted, neighbors, weights in self._steps:
            numbers[wanted] += _predicted(numbers[neighbors], weights)
        return numbers


def lattice_of(points: Floats) -> NDArray[np.int64]:
    """(n, 3) whole coordinates of points (n, 3), up to 2^20: the same on every machine and in every unit."""
    offsets = points - points.min(axis=0, initial=np.inf)
    size = float(offsets.max(initial=0.0))
    # The power of two above the size: scaling by it is exact.
    exponent = BITS - int(np.frexp(size if size > 0.0 else 1.0)[1])
    return np.asarray(np.floor(np.ldexp(offsets, exponent)).astype(np.int64))


def levels_along(along: NDArray[np.int64]) -> Ints:
    """(n,) 0 for the first point in each of a few large cells, 1 for that in each cell of half the size, and so on."""
    levels = np.full(len(along), BITS, dtype=np.int64)
    for level in range(BITS):
        _, first = np.unique(along >> 3 * (BITS - 1 - level), return_index=True)
        new = first[levels[first] == BITS]
        levels[new] = level
        if (levels < BITS).all():
            break
    return levels


def along_curve(lattice: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) places along a curve that fills space (Morton): points that are near stand together."""
    places = np.zeros(len(lattice), dtype=np.int64)
    for bit in range(BITS):
        for axis in range(3):
            places |= (lattice[:, axis] >> bit & 1) << (3 * bit + axis)
    return places


def _neighbors(lattice: NDArray[np.int64], known: Ints, wanted: Ints) -> tuple[Ints, NDArray[np.int64]]:
    """The nearest known points of each wanted one, and how much each counts: less with the square of its distance."""
    count = min(_CANDIDATES, len(known))
    near = np.reshape(cKDTree(lattice[known]).query(lattice[wanted], k=count)[1], (len(wanted), count))
    candidates = known[near]
    squares = ((lattice[candidates] - lattice[wanted][:, None]) ** 2).sum(axis=2)
    order = np.lexsort((candidates, squares))[:, :_NEIGHBORS]
    squares = np.maximum(np.take_along_axis(squares, order, axis=1), 1)
    weights = np.maximum((squares[:, :1] << _WEIGHT_BITS) // squares, 1)
    return np.asarray(np.take_along_axis(candidates, order, axis=1)), np.asarray(weights)


def _predicted(numbers: NDArray[np.int64], weights: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n, c) rounded means of numbers (n, k, c) with weights (n, k)."""
    total = weights.sum(axis=1)[:, None]
    sums: NDArray[np.int64] = (numbers * weights[:, :, None]).sum(axis=1)
    return np.asarray((sums + total // 2) // total)
