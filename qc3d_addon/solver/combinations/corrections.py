# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shapes that keys should make together at several of their values: what correction keys are made from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..settings import FitOptions
from ..support.memory import estimated_mb, require_memory
from ..support.progress import Progress, Steps, told
from .base import KeysOnBase
from .combine import together
from .composer import Composer
from .order import outermost_first

# Of the size: what is less than this of a difference between the sum and what the keys show is rounding.
_ROUNDING = 1e-5


@dataclass(frozen=True, eq=False)
class Corrections:
    """What to compute for keys that are on at once.

    Parameters
    ----------
    base : (n, 3)
        The shape that the keys are relative to.
    alone : (k, v, n, 3)
        What each key shows by itself at each of its values, the last of which is 1.
    sculpted : (n, 3)
        What all keys show together now: their sum, unless the user has sculpted a shape for all of them.
    places : (g, k) int64
        Combinations of values: for each key the index of its value.
    values : (v,)
        The values.
    faces, edges : (m, 3), (e, 2) int64
    find_order : bool
        Whether to find the outer key; otherwise the keys go from the outermost to the innermost.
    fit_options : FitOptions
        Options of the fit that keeps shapes from crossing themselves.
    """

    base: Floats
    alone: Floats
    sculpted: Floats
    places: Ints
    values: Floats
    faces: Ints
    edges: Ints
    find_order: bool
    fit_options: FitOptions

    def require_memory(self, limit_mb: float) -> None:
        """Raise InputError, before the work starts, if it needs more than ``limit_mb`` megabytes; 0 means no limit."""
        if limit_mb:
            count, frames = len(self.base), self.alone.shape[0] * self.alone.shape[1] + len(self.places)
            needed = estimated_mb(count, 1, frames, self.fit_options.quality, True, len(self.faces))
            require_memory(needed, limit_mb, count)

    def carried_out(self) -> Steps[Corrected]:
        """Compute the shapes.

        Raises
        ------
        InputError
            If the keys cannot be used.
        """
        yield Progress("frames", 0.0)
        keys = KeysOnBase(self.base, list(self.alone[:, -1]), self.faces, self.edges)
        order = outermost_first(keys) if self.find_order else tuple(range(len(self.alone)))
        composer = Composer(keys)
        whole = [self.alone[number, -1] for number in order]
        total = self.base + sum(shape - self.base for shape in whole)
        is_sculpted = bool(np.linalg.norm(self.sculpted - total, axis=1).max() > _ROUNDING * keys.diagonal)
        beside, turned = None, None
        if is_sculpted:
            beside, turned = self.sculpted - composer.composed(whole), composer.turns(whole)
        shapes, crossings = np.empty((len(self.places), *self.base.shape)), 0
        for number, places in enumerate(self.places):
            values = self.values[places]
            on = [self.alone[key, places[key]] for key in order]
            if beside is None or turned is None:
                work = together(keys, on, self.fit_options, composer)
                shapes[number], crossed = yield from told(work, _Sharing(number, len(self.places)).of)
                crossings = max(crossings, crossed or 0)
            elif values.min() == 1.0:
                shapes[number] = self.sculpted
            else:
                # What the user sculpted beside the computed shape, as far as the keys are on, turned with what it is
                # on.
                turn = composer.turns(on) @ turned.transpose(0, 2, 1)
                shapes[number] = composer.composed(on) + np.prod(values) * np.einsum("nij,nj->ni", turn, beside)
            yield Progress("frames", (number + 1) / len(self.places))
        full = int(np.flatnonzero((self.values[self.places] == 1.0).all(axis=1))[0])
        off = float(np.linalg.norm(shapes[full] - total, axis=1).max()) / keys.diagonal
        return Corrected(tuple(order), shapes, crossings, off, is_sculpted)


@dataclass(frozen=True, eq=False)
class Corrected:
    """The shapes of keys that are on at once.

    Parameters
    ----------
    order : tuple of int
        Indices of the keys, outermost first.
    shapes : (g, n, 3)
        The shape for each combination of values.
    crossings : int
        Largest number of pairs of triangles that cross in a shape but in none of the keys.
    off : float
        Largest distance of the plain sum from the shape with all keys fully on, over the size.
    is_sculpted : bool
        Whether the user had sculpted a shape for all of them; the shapes then lead to it.
    """

    order: Sequence[int]
    shapes: Floats
    crossings: int
    off: float
    is_sculpted: bool


@dataclass(frozen=True)
class _Sharing:
    """One of several pieces of work of equal size, all of which count as stage of the frames."""

    number: int
    count: int

    def of(self, step: Progress) -> Progress:
        return Progress("frames", (self.number + step.overall) / self.count)
