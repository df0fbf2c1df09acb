# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Chebyshev acceleration of fixed-point iterations.

The weights are fixed in advance, so the result depends smoothly on the starting point. Adaptive schemes such as
Anderson mixing do not have that property: in-betweens computed with them jump from one time to the next.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

from ..arrays import Floats

# The first steps are not accelerated: until the fast-decaying errors are gone, the iteration is far from linear (Wang
# 2015 delays the start for the same reason).
_PLAIN_STEPS = 3


class ChebyshevIteration:
    """Chebyshev semi-iterative method: computes the next point of a fixed-point iteration from the last two.

    Parameters
    ----------
    radius : float
        Assumed spectral radius of the plain iteration, 0..1: the factor by which one step shrinks the slowest error.
    relaxation : float
        Factor on each step; above 1 over-relaxes.

    References
    ----------
    Golub & Varga, "Chebyshev semi-iterative methods, successive overrelaxation iterative methods, and second order
    Richardson iterative methods", 1961. Wang, "A Chebyshev semi-iterative approach for accelerating projective and
    position-based dynamics", 2015.
    """

    def __init__(self, radius: float, relaxation: float) -> None:
        self._square = radius**2
        self._relaxation = relaxation
        self._steps = 0
        self._weight = 1.0
        self._before: Floats | None = None

    def of(self, columns: Sequence[int] | slice) -> ChebyshevIteration:
        """An iteration that goes on from here by itself, for some entries of the second axis of all points."""
        other = copy.copy(self)
        other._before = None if self._before is None else self._before[:, columns]
        return other

    def next(self, point: Floats, mapped: Floats) -> Floats:
        """The next point, given the present ``point`` and what the plain iteration maps it to; any array shape."""
        if self._steps == _PLAIN_STEPS:
            self._weight = 2.0 / (2.0 - self._square)
        elif self._steps > _PLAIN_STEPS:
            self._weight = 4.0 / (4.0 - self._square * self._weight)
        before = point if self._before is None else self._before
        self._steps += 1
        self._before = point
        return before + self._weight * (self._relaxation * (mapped - point) + point - before)
