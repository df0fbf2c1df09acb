# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The lowest eigenvectors of large sparse matrices, without factoring them.

Locally optimal block preconditioned conjugate gradients (Knyazev 2001), with the bases of Hetmaniuk & Lehoucq (2006)
that stay orthonormal, and a block that moves up: what has converged at its lower end is put aside, and as many new
vectors come in at the upper end.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from ..arrays import Bools, Floats
from ..errors import InputError

BLOCK = 80  # vectors that are worked on at once
GUARDS = 20  # more than asked for: the uppermost vectors of a block converge slowly
_MOST_ITERATIONS = 1000
_DEPENDENT = 1e-10
_ROWS = 4096  # that are turned at once


class EigenPairs(NamedTuple):
    """Eigenvalues (k,), ascending, and orthonormal eigenvectors (n, k)."""

    values: Floats
    vectors: Floats


def coarse_eigenvectors(matrix: csr_array, interpolation: csr_array, count: int) -> Floats:
    """(n, count) approximations: the lowest eigenvectors among what is interpolated from few unknowns.

    Parameters
    ----------
    matrix : (n, n) sparse
        Symmetric.
    interpolation : (n, m) sparse
    count : int
        At most m.
    """
    small = (interpolation.T @ (matrix @ interpolation)).toarray()
    mass = (interpolation.T @ interpolation).toarray()
    return np.asarray(interpolation @ eigh(small, mass, subset_by_index=(0, count - 1))[1])


def lowest_eigenvectors(
    matrix: csr_array, precondition: Callable[[Floats], Floats], start: Floats, count: int, tolerance: float
) -> EigenPairs:
    """The lowest eigenvectors of a symmetric matrix.

    Parameters
    ----------
    matrix : (n, n) sparse
    precondition : callable
        Takes (n, j) nearly to what the matrix takes to it.
    start : (n, k)
        Approximations, the lowest first, at least ``GUARDS`` more than ``count``.
    count : int
    tolerance : float
        Residuals may have this length, where the vectors have the length 1.

    Raises
    ------
    InputError
        If the iteration does not converge.
    """
    block = _Block(matrix, precondition, start, tolerance)
    for _ in range(_MOST_ITERATIONS):
        if block.is_done(count):
            return block.lowest(count)
        block.improve()
    raise InputError(
        "The modes of this mesh do not converge, which very thin tetrahedra can cause; use fewer modes or mesh the "
        "domain again."
    )


class _Block:
    """What is worked on: a basis of vectors that converge and, behind them, of the directions that they came along."""

    def __init__(
        self, matrix: csr_array, precondition: Callable[[Floats], Floats], start: Floats, tolerance: float
    ) -> None:
        self._matrix, self._precondition, self._tolerance = matrix, precondition, tolerance
        self._found, self._values = np.empty((len(start), 0)), np.empty(0)
        self._start, self._taken = start, min(BLOCK, start.shape[1])
        basis = _orthonormal(_orthonormal(start[:, : self._taken]))
        self._size = self._width = basis.shape[1]  # of the vectors, and of the basis
        # In one place for good, with room for search directions: memory is what limits the size of meshes.
        self._room = np.empty((len(start), 3 * self._size))
        self._room[:, : self._size] = basis
        values, turn = np.linalg.eigh(basis.T @ (matrix @ basis))
        self._reduced = np.diag(values)
        self._residuals: Floats = np.empty(0)
        self._converged: Bools = np.empty(0, dtype=bool)
        self._turn(turn)
        self._look()

    def is_done(self, count: int) -> bool:
        return len(self._values) + self._leading >= count

    def lowest(self, count: int) -> EigenPairs:
        self._put_aside()
        order = np.argsort(self._values, kind="stable")[:count]
        return EigenPairs(self._values[order], self._found[:, order])

    def improve(self) -> None:
        """One step: the best vectors in the span of these, their last directions, and preconditioned residuals."""
        search, self._residuals = self._residuals[:, ~self._converged], np.empty(0)
        if search.size:
            search = self._precondition(search)
        fresh = 0
        if self._leading >= self._size // 4 and self._taken < self._start.shape[1]:
            entering = self._start[:, self._taken : self._taken + self._leading]
            fresh = entering.shape[1]
            self._taken += fresh
            self._put_aside()
            search = np.concatenate([entering, search], axis=1)
        basis = self._room[:, : self._width]
        search = _orthonormal_to([self._found, basis], search)
        image = self._matrix @ search
        across, own = basis.T @ image, search.T @ image
        del image
        reduced = np.block([[self._reduced, across], [across.T, 0.5 * (own + own.T)]])
        size = self._size + fresh
        best = np.linalg.eigh(reduced)[1][:, :size]
        # Directions: what the vectors got from elsewhere, orthonormal among themselves and to the vectors.
        directions = best[:, np.concatenate([~self._converged, np.ones(fresh, dtype=bool)])]
        directions[: self._size] = 0.0
        for _ in range(2):
            directions -= best @ (best.T @ directions)
            directions = np.linalg.qr(directions)[0]
        turn = np.concatenate([best, directions], axis=1)
        self._room[:, self._width : len(reduced)] = search
        self._reduced, self._size = turn.T @ reduced @ turn, size
        self._turn(turn)
        self._look()

    def _turn(self, turn: Floats) -> None:
        """Replace what is in the room by combinations of it, some rows at a time."""
        self._width = turn.shape[1]
        for first in range(0, len(self._room), _ROWS):
            rows = self._room[first : first + _ROWS]
            rows[:, : self._width] = rows[:, : len(turn)] @ turn

    def _look(self) -> None:
        vectors = np.ascontiguousarray(self._room[:, : self._size])
        self._residuals = np.asarray(self._matrix @ vectors)
        self._residuals -= vectors * np.diag(self._reduced)[: self._size]
        self._converged = np.linalg.norm(self._residuals, axis=0) <= self._tolerance

    @property
    def _leading(self) -> int:
        """How many have converged before the first that has not."""
        return self._size if self._converged.all() else int(np.argmin(self._converged))

    def _put_aside(self) -> None:
        leading = self._leading
        self._found = np.concatenate([self._found, self._room[:, :leading]], axis=1)
        self._values = np.concatenate([self._values, np.diag(self._reduced)[:leading]])
        self._turn(np.eye(self._width)[:, leading:])
        self._reduced = self._reduced[leading:, leading:]
        self._converged = self._converged[leading:]
        self._size -= leading


def _orthonormal_to(bases: list[Floats], vectors: Floats) -> Floats:
    """An orthonormal basis of what is left of vectors without what they have in common with orthonormal bases."""
    for _ in range(2):
        for basis in bases:
            vectors = vectors - basis @ (basis.T @ vectors)
        vectors = _orthonormal(vectors)
    return vectors


def _orthonormal(vectors: Floats) -> Floats:
    """About an orthonormal basis (n, j) of vectors (n, k); a second time, exactly so. Dependent ones are dropped."""
    vectors = vectors / np.maximum(np.linalg.norm(vectors, axis=0), 1e-300)
    values, turn = np.linalg.eigh(vectors.T @ vectors)
    kept = values > _DEPENDENT * values[-1]
    return np.asarray(vectors @ (turn[:, kept] / np.sqrt(values[kept])))
