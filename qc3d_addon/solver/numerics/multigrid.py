# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Algebraic multigrid by smoothed aggregation, for stiffness matrices of meshes.

After Vanek, Mandel & Brezina (1996), "Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
problems". Aggregates grow around vertices that no other chosen one is within two steps of, all at once (Luby 1986).
Chebyshev polynomials smooth (Adams, Brezina, Hu & Tuminaro 2003). One cycle is an approximate solution, good enough to
precondition conjugate gradients and eigenvalue iterations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from ..arrays import Floats, Ints

_COARSEST = 400  # unknowns that are factored
_POWER_STEPS, _MARGIN = 12, 1.1  # of the estimate of the largest eigenvalue
_DAMPING = 4.0 / 3.0
_DEGREE, _SMOOTHED = 4, 16.0  # the smoother takes away what has eigenvalues above a sixteenth of the largest

# Approximate solutions need no more; it halves the memory that is moved.
_Singles = NDArray[np.float32]


class _Level(NamedTuple):
    matrix: csr_array
    inverse_diagonal: _Singles  # (n, 1)
    largest: float  # eigenvalue of the matrix over its diagonal
    from_coarse: csr_array
    to_coarse: csr_array


class Multigrid:
    """Approximate inverse of a sparse symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) sparse
        Every row has a diagonal entry.
    smooth : (n,)
        The vector that the matrix nearly takes to zero, nowhere zero: ones for a stiffness matrix.
    rng : Generator
        For the order in which aggregates are chosen.
    """

    def __init__(self, matrix: csr_array, smooth: Floats, rng: Generator) -> None:
        self._levels: list[_Level] = []
        self.interpolation: csr_array | None = None
        while matrix.shape[0] > _COARSEST:
            labels = _aggregates(matrix, rng)
            count = int(labels.max()) + 1
            if count == len(labels):
                break
            diagonal = matrix.diagonal()
            largest = _largest_eigenvalue(matrix, diagonal, rng)
            lengths = np.sqrt(np.bincount(labels, smooth**2, count))
            tentative = csr_array(
                (smooth / lengths[labels], (np.arange(len(labels)), labels)), shape=(len(labels), count)
            )
            step = diags_array(_DAMPING / largest / diagonal)
            smoothed = csr_array(tentative - step @ (matrix @ tentative))
            if self.interpolation is None:
                self.interpolation = smoothed
            self._levels.append(
                _Level(
                    matrix.astype(np.float32),
                    (1.0 / diagonal).astype(np.float32)[:, None],
                    largest,
                    smoothed.astype(np.float32),
                    csr_array(smoothed.T).astype(np.float32),
                )
            )
            matrix, smooth = csr_array(smoothed.T @ (matrix @ smoothed)), lengths
        self._coarsest = splu(csc_array(matrix))

    def approximate_solution(self, right: Floats) -> Floats:
        """(n, k) what the matrix takes nearly to ``right`` (n, k), by one cycle."""
        return self._cycle(0, right.astype(np.float32)).astype(np.float64)

    def _cycle(self, depth: int, right: _Singles) -> _Singles:
        if depth == len(self._levels):
            return self._coarsest.solve(right.astype(np.float64)).astype(np.float32)
        level = self._levels[depth]
        found = _smoothed(level, right, None)
        found += level.from_coarse @ self._cycle(depth + 1, level.to_coarse @ (right - level.matrix @ found))
        return _smoothed(level, right, found)


def _smoothed(level: _Level, right: _Singles, start: _Singles | None) -> _Singles:
    """Chebyshev's iteration for the upper part of the spectrum (Saad 2003, algorithm 12.1)."""
    middle = 0.5 * level.largest * (1.0 + 1.0 / _SMOOTHED)
    half = 0.5 * level.largest * (1.0 - 1.0 / _SMOOTHED)
    ratio = middle / half
    weight = 1.0 / ratio
    missing = right if start is None else right - level.matrix @ start
    step = level.inverse_diagonal * missing / np.float32(middle)
    found = step.copy() if start is None else start + step
    for _ in range(_DEGREE - 1):
        missing = right - level.matrix @ found
        following = 1.0 / (2.0 * ratio - weight)
        step *= np.float32(following * weight)
        step += np.float32(2.0 * following / half) * (level.inverse_diagonal * missing)
        found += step
        weight = following
    return np.asarray(found, dtype=np.float32)


def _largest_eigenvalue(matrix: csr_array, diagonal: Floats, rng: Generator) -> float:
    """An upper estimate for the matrix over its diagonal, by the power method."""
    vector = rng.normal(size=len(diagonal))
    for _ in range(_POWER_STEPS):
        vector = matrix @ vector / diagonal
        vector /= np.linalg.norm(vector)
    return _MARGIN * float(np.linalg.norm(matrix @ vector / diagonal))


def _aggregates(matrix: csr_array, rng: Generator) -> Ints:
    """(n,) the number of the aggregate that each unknown belongs to."""

    def largest_around(values: Floats) -> Floats:
        return np.asarray(np.maximum.reduceat(values[matrix.indices], matrix.indptr[:-1]))

    priority = rng.permutation(matrix.shape[0]) + 1.0
    open_, centers = np.ones(len(priority), dtype=bool), np.zeros(len(priority), dtype=bool)
    while open_.any():
        rank = np.where(open_, priority, 0.0)
        winners = open_ & (largest_around(largest_around(rank)) == rank)
        centers |= winners
        open_ &= largest_around(largest_around(winners.astype(np.float64))) == 0.0
    labels = np.where(centers, np.cumsum(centers), 0).astype(np.float64)
    for _ in range(2):
        labels = np.where(labels == 0.0, largest_around(labels), labels)
    return labels.astype(np.int64) - 1
