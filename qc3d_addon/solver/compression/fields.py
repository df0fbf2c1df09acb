# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields of displacements as whole numbers, in three ways, and along time by their principal components.

``plain``
    Each number in steps, in the order of the file or along a curve that fills space, or by how it changes from row to
    row: what simple programs do.
``levels``
    Each point by what those around it let expect (module ``hierarchy``).
``modes``
    Coefficients of the mesh's own modes (module ``graph_modes``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..arrays import Bools, Floats, Ints
from ..errors import InputError
from .graph_modes import MOST_MODES, MOST_VERTICES, graph_modes, laplacian
from .hierarchy import Hierarchy

Kind = Literal["plain", "levels", "modes"]
KINDS: tuple[Kind, ...] = get_args(Kind)
# By how much steps grow from one level to the next finer one.
GROWTHS = (1.0, 1.2, 1.4, 1.7)
# Of ``plain``: the order of points (the file's, along the curve) and how often differences along the rows are taken.
ORDERS = 3


class Space:
    """Where fields belong: points, which of them are neighbors, and what is known to be 0.

    Parameters
    ----------
    points : (n, 3)
    cells : (m, 3 or 4)
        Triangles or tetrahedra.
    free : (n, 3), optional
        Components that are not known to be 0; all where it is not given.
    """

    def __init__(self, points: Floats, cells: Ints, free: Bools | None = None) -> None:
        self.points, self._cells = points, cells
        self.free: Bools = np.ones(points.shape, dtype=bool) if free is None else free
        self._modes: tuple[Floats, ...] | None = None

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """The order of the points for ``levels``."""
        return Hierarchy(self.points)

    @property
    def most_modes(self) -> int:
        """How many modes there may be: none where they would take minutes."""
        count = len(self.points)
        return 0 if count > MOST_VERTICES else min(MOST_MODES, count // 4)

    @property
    def is_surface(self) -> bool:
        """Whether the cells are triangles."""
        return bool(self._cells.shape[1] == 3)

    def modes(self, count: int) -> tuple[Floats, ...]:
        """For each coordinate (n, k) modes that are 0 where it is known; k is at most ``count``."""
        if self._modes is None or self._modes[0].shape[1] < count:
            corners = self._cells.shape[1]
            pairs = np.concatenate([self._cells[:, [a, b]] for a in range(corners) for b in range(a)])
            matrix = laplacian(np.unique(np.sort(pairs, axis=1), axis=0), len(self.points))
            distinct, which = np.unique(self.free, axis=1, return_inverse=True)
            found = [graph_modes(matrix, column, count, is_surface=self.is_surface) for column in distinct.T]
            # As many for each coordinate.
            columns = np.zeros((3, len(self.points), count))
            for coordinate, number in enumerate(which.ravel()):
                modes = found[number]
                columns[coordinate, :, : modes.shape[1]] = modes
            self._modes = tuple(columns)
        return tuple(modes[:, :count] for modes in self._modes)


@dataclass(frozen=True, eq=False)
class Part:
    """R fields as whole numbers.

    Parameters
    ----------
    kind : Kind
    option : int
        Of ``plain``: 1 along the curve, 0 in the file's order; plus twice the order of differences. Of ``levels``: the
        number of the growth among ``GROWTHS``. Of ``modes``: 0.
    step : float
        What the number 1 stands for; single precision. If it is 0, no numbers are stored.
    numbers : (R, n, 3) or, of modes, (R, k, 3)
    """

    kind: Kind
    option: int
    step: float
    numbers: NDArray[np.int64]

    def field(self, space: Space) -> Floats:
        """(R, n, 3) the field."""
        if self.kind == "plain":
            return np.asarray(self.step * self.numbers)
        if self.kind == "levels":
            return space.hierarchy.field(self.numbers, self.step, GROWTHS[self.option], space.free)
        return synthesized(space, np.asarray(self.step * self.numbers, dtype=np.float64))

    def stream(self, space: Space) -> NDArray[np.int64]:
        """(k,) the numbers in the order in which they cost least."""
        if not self.step:
            return np.empty(0, dtype=np.int64)
        if self.kind == "modes":
            return self.numbers.ravel()
        order = self._order(space)
        numbers = self.numbers
        if self.kind == "plain":
            for _ in range(self.option >> 1):
                numbers = np.diff(numbers, axis=0, prepend=np.zeros_like(numbers[:1]))
        return np.asarray(numbers[:, order].transpose(0, 2, 1)[:, space.free[order].T].ravel())

    @classmethod
    def of_stream(cls, space: Space, kind: Kind, option: int, step: float, rows: int, stream: Ints) -> Part:
        """The part with that stream, of ``rows`` fields."""
        if not step:
            return cls("plain", 0, 0.0, np.zeros((rows, len(space.points), 3), dtype=np.int64))
        if kind == "modes":
            return cls(kind, option, step, stream.reshape(rows, -1, 3))
        part = cls(kind, option, step, np.zeros((0, 0, 3), dtype=np.int64))
        order = part._order(space)
        ordered = np.zeros((rows, 3, len(order)), dtype=np.int64)
        ordered[:, space.free[order].T] = stream.reshape(rows, -1)
        numbers = np.zeros((rows, len(order), 3), dtype=np.int64)
        numbers[:, order] = ordered.transpose(0, 2, 1)
        if kind == "plain":
            for _ in range(option >> 1):
                numbers = np.cumsum(numbers, axis=0)
        return cls(kind, option, step, numbers)

    def _order(self, space: Space) -> Ints:
        if self.kind == "levels":
            return space.hierarchy.order
        return space.hierarchy.along if self.option & 1 else np.arange(len(space.points))


def length_of_stream(space: Space, kind: Kind, rows: int, modes: int) -> int:
    """How many numbers a part of ``rows`` fields has."""
    return rows * (3 * modes if kind == "modes" else int(np.count_nonzero(space.free)))


def analyzed(space: Space, field: Floats, count: int) -> Floats:
    """(R, k, 3) coefficients of fields (R, n, 3) in the first modes."""
    return np.stack([field[:, :, c] @ modes for c, modes in enumerate(space.modes(count))], axis=2)


def synthesized(space: Space, coefficients: Floats) -> Floats:
    """(R, n, 3) the fields with coefficients (R, k, 3)."""
    every = space.modes(coefficients.shape[1])
    return np.stack([coefficients[:, :, c] @ modes.T for c, modes in enumerate(every)], axis=2)


@dataclass(frozen=True, eq=False)
class Field:
    """F displacements of one mesh.

    Parameters
    ----------
    part : Part
        Its rows are the displacements, or what these are sums of.
    factors : (F, R) int64, optional
        How much of each row is in each displacement, in steps.
    factor_bits : int
        The steps of factors are 2 to the power of minus this.
    """

    part: Part
    factors: NDArray[np.int64] | None = None
    factor_bits: int = 0

    def displacements(self, space: Space) -> Floats:
        """(F, n, 3)."""
        return combined(self.part.field(space), self.mixing)

    @property
    def mixing(self) -> Floats | None:
        """(F, R) the factors as numbers."""
        return None if self.factors is None else np.ldexp(self.factors.astype(np.float64), -self.factor_bits)


def combined(rows: Floats, mixing: Floats | None) -> Floats:
    """(F, n, 3) sums of rows (R, n, 3) with factors (F, R)."""
    return rows if mixing is None else np.asarray(np.tensordot(mixing, rows, axes=1))


def check_of(field: Floats) -> float:
    """A sum with signs that no symmetry has, by which it is told whether two machines have made the same field."""
    if not np.isfinite(field).all():
        raise InputError("What the file means is not finite; the file is damaged.")
    signs = 1.0 - 2.0 * (np.arange(field.size, dtype=np.uint64) * np.uint64(2654435761) >> np.uint64(16) & 1)
    return float(signs @ field.ravel() / np.sqrt(max(field.size, 1)))
