# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixed-point iterations made quicker by fixed weights: what they reach depends smoothly on what they start at."""

from __future__ import annotations

from ..arrays import Floats

_PLAIN_STEPS = 3


class ChebyshevIteration:
    """The next point of a fixed-point iteration from the last two (Golub & Varga 1961; for shapes Wang 2015).

    Parameters
    ----------
    radius : float
        How much an error is taken to shrink in each step of the iteration itself, 0..1.
    relaxation : float
        How far to go along a step; above 1 goes further than it asks for.
    """

    def __init__(self, radius: float, relaxation: float) -> None:
        self._square = radius**2
        self._relaxation = relaxation
        self._steps = 0
        self._weight = 1.0
        self._before: Floats | None = None

    def next(self, point: Floats, mapped: Floats) -> Floats:
        """The point after ``point``, which the iteration takes to ``mapped``; arrays of any one shape."""
        if self._steps == _PLAIN_STEPS:
            self._weight = 2.0 / (2.0 - self._square)
        elif self._steps > _PLAIN_STEPS:
            self._weight = 4.0 / (4.0 - self._square * self._weight)
        before = point if self._before is None else self._before
        self._steps += 1
        self._before = point
        return before + self._weight * (self._relaxation * (mapped - point) + point - before)
