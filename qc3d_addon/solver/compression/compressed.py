# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps as the whole numbers of a scheme that has a name, and nothing that computes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..arrays import Bools, Floats
from ..errors import InputError

Scheme = Literal["published", "logarithm", "fitted"]
Boundary = Literal["sliding", "fixed"]  # a fixed one exactly, or in steps

# Numbers beyond so many steps do not fit the format; a step that makes larger ones is too small to be of use.
MOST_STEPS = 2**40


@dataclass(frozen=True, eq=False)
class Compressed:
    """F maps of one mesh as whole numbers, all with the same steps.

    Parameters
    ----------
    scheme, boundary
    step : float
        What the number 1 stands for in the lowest mode.
    numbers : (F, k, 6) int64
        Coefficients of the six channels in steps, by mode.
    held : (F, b, 3)
        Images of the boundary's vertices where it is fixed, in the order of their numbers; none where it slides.
    check : float
        A sum over the rebuilt maps, by which the restoring knows that it has rebuilt the same ones.
    remainder_step : float
        What the number 1 stands for in the remainder, in units of the map.
    remainder : (F, n, 3) int64
        Displacements that follow the rebuilding, in steps; n is 0 for none.
    held_step : float
        In what steps the images of a fixed boundary are from where it was; 0 where they are exact.
    """

    scheme: Scheme
    boundary: Boundary
    step: float
    numbers: NDArray[np.int64]
    held: Floats
    check: float = 0.0
    remainder_step: float = 0.0
    remainder: NDArray[np.int64] | None = None
    held_step: float = 0.0

    @property
    def changes(self) -> Bools:
        """(F - 1,) whether the rebuilt map is another one than that before it."""
        of_numbers = (np.diff(self.numbers, axis=0) != 0).any(axis=(1, 2))
        return np.asarray(of_numbers | (np.diff(self.held, axis=0) != 0.0).any(axis=(1, 2)))


def whole_steps(multiples: Floats, step: float) -> NDArray[np.int64]:
    """Multiples of a step as whole numbers; raises InputError if the step is too small for them."""
    numbers = np.round(multiples)
    if not np.abs(numbers).max(initial=0.0) < MOST_STEPS:
        raise InputError(f"The step {step:.3g} is too small for this map; choose a larger one.")
    return numbers.astype(np.int64)
