# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields at points, told by how far each point is from what is known around it: coarse points first, then between.

What points between known ones are expected to have is found by kriging (Matheron 1963) with a linear variogram. Fields
of bent and turned limbs are nearly linear from place to place, so there is a linear drift, drawn toward zero. Each
point is told relative to what the reader will have, not to the true field, so errors do not add up; and coarse points,
on which all others depend, are told more exactly.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from .prediction import BITS, along_curve, lattice_of, levels_along

_NEIGHBORS = 12
_FEWEST = 6  # known points for a drift
_DRIFT = 1.0  # what a slope costs, relative to what a jump costs
_NUGGET = 1e-6  # makes coincident points harmless
_AT_ONCE = 1 << 14  # points whose systems are solved at once: 30 MB
_CROWDED = 0.9  # of the points are not finer than the level at which steps stop growing
_JITTER_BITS = 5

Number = TypeVar("Number", np.int64, np.float64)


class Hierarchy:
    """The order of points, and who tells of whom.

    Parameters
    ----------
    points : (n, 3)
        Where the fields belong; what reads them must have the same points.
    """

    def __init__(self, points: Floats) -> None:
        lattice = lattice_of(points)
        along = along_curve(lattice)
        self.levels = levels_along(along)
        self.order: Ints = np.lexsort((along, self.levels))
        self.along: Ints = np.argsort(along, kind="stable")
        self._crowded = int(np.quantile(self.levels, _CROWDED)) if len(points) else 0
        places = _apart(lattice)
        self._steps: list[tuple[int, Ints, csr_array]] = []
        for level in range(int(self.levels.max(initial=-1)) + 1):
            known, wanted = np.flatnonzero(self.levels < level), np.flatnonzero(self.levels == level)
            if len(wanted):
                self._steps.append((level, wanted, _kriging(places, known, wanted)))

    def numbers(self, field: Floats, step: float, growth: float, free: NDArray[np.bool_], threshold: float) -> Ints:
        """(F, n, 3) whole numbers for fields (F, n, 3); see ``field`` for step and growth.

        Parameters
        ----------
        free : (n, 3)
            Which components are not known to be 0.
        threshold : float
            In steps, 0.5 to 1: differences that are smaller are told as 0, which costs least.
        """
        wide, mask = _beside(field), np.tile(free, len(field))
        numbers = np.zeros(wide.shape, dtype=np.int64)
        made = np.zeros_like(wide)
        for level, wanted, expectation in self._steps:
            size = self._step(step, growth, level)
            expected = expectation @ made
            missed = (wide[wanted] - expected) / size
            told = np.sign(missed) * np.floor(np.abs(missed) + (1.0 - threshold)) * mask[wanted]
            numbers[wanted] = told
            made[wanted] = (expected + size * told) * mask[wanted]
        return _above(numbers)

    def field(self, numbers: Ints, step: float, growth: float, free: NDArray[np.bool_]) -> Floats:
        """(F, n, 3) what whole numbers (F, n, 3) mean.

        Parameters
        ----------
        step : float
            What the number 1 stands for at the finest points.
        growth : float
            From one level to the next finer one the steps grow by this factor.
        """
        wide, mask = _beside(numbers), np.tile(free, len(numbers))
        made = np.zeros(wide.shape)
        for level, wanted, expectation in self._steps:
            made[wanted] = (expectation @ made + self._step(step, growth, level) * wide[wanted]) * mask[wanted]
        return _above(made)

    def _step(self, step: float, growth: float, level: int) -> float:
        return float(step * growth ** min(level - self._crowded, 0))


def _apart(lattice: NDArray[np.int64]) -> Floats:
    """(n, 3) the points, each moved a little in its own way: no two distances are equal, so no order is in doubt.

    All are whole numbers, whose distances double precision tells exactly.
    """
    scattered = np.arange(lattice.size, dtype=np.uint64).reshape(lattice.shape) * np.uint64(0x9E3779B97F4A7C15)
    jitter = (scattered >> np.uint64(64 - _JITTER_BITS)).astype(np.int64)
    return np.asarray(((lattice << _JITTER_BITS) + jitter).astype(np.float64))


def _kriging(points: Floats, known: Ints, wanted: Ints) -> csr_array:
    """(w, n) sparse: what wanted points are expected to have, as means of what known ones have; 0 where none is."""
    shape, count = (len(wanted), len(points)), min(_NEIGHBORS, len(known))
    if not count:
        return csr_array(shape)
    near = np.reshape(cKDTree(points[known]).query(points[wanted], k=count)[1], (len(wanted), count))
    neighbors = known[near]
    weights = np.full(neighbors.shape, 1.0 / count)
    for start in range(0, len(wanted) if count >= _FEWEST else 0, _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        weights[some] = _weights(points[neighbors[some]] - points[wanted[some], None])
    return csr_array((weights.ravel(), neighbors.ravel(), np.arange(0, weights.size + 1, count)), shape)


def _weights(offsets: Floats) -> Floats:
    """(w, k) weights of neighbors at offsets (w, k, 3) from the points where a value is wanted."""
    rows, count = offsets.shape[:2]
    distances = np.sqrt((offsets**2).sum(axis=2))
    reach = np.maximum(distances.max(axis=1), 2.0**-BITS)[:, None]
    distances = distances / reach
    places = offsets / reach[:, :, None]
    between = np.sqrt(((places[:, :, None] - places[:, None]) ** 2).sum(axis=3))
    system = np.zeros((rows, count + 4, count + 4))
    system[:, :count, :count] = _NUGGET * np.eye(count) - between
    system[:, :count, count] = system[:, count, :count] = 1.0
    system[:, :count, count + 1 :] = places
    system[:, count + 1 :, :count] = places.transpose(0, 2, 1)
    system[:, count + 1 :, count + 1 :] = -_DRIFT * np.eye(3)
    sides = np.zeros((rows, count + 4, 1))
    sides[:, :count, 0] = -distances
    sides[:, count, 0] = 1.0
    return np.asarray(np.linalg.solve(system, sides)[:, :count, 0])


def _beside(fields: NDArray[Number]) -> NDArray[Number]:
    """(n, 3 F) fields (F, n, 3) side by side."""
    return np.ascontiguousarray(fields.transpose(1, 0, 2)).reshape(fields.shape[1], -1)


def _above(wide: NDArray[Number]) -> NDArray[Number]:
    """(F, n, 3) fields that were side by side."""
    return np.ascontiguousarray(wide.reshape(len(wide), -1, 3).transpose(1, 0, 2))
