# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Preconditioned conjugate gradients that end by the preconditioned residual.

The common ending, by the plain residual, is too early for stiff systems: the first step meets the stiffest equations,
and what is left of the others hardly shows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Floats

Product = Callable[[Floats], Floats]


def conjugate_gradients(
    multiply: Product, precondition: Product, load: Floats, tolerance: float, most_steps: int
) -> tuple[Floats, int]:
    """Solve A x = load for a symmetric positive definite A.

    Parameters
    ----------
    multiply, precondition : callable
        Take vectors (n,) to A times them, and to about A⁻¹ times them, which is symmetric positive definite too.
    load : (n,)
    tolerance : float
        The end is where rᵀ M⁻¹ r, of the residual r and the preconditioner M, is this squared times its first value.
    most_steps : int

    Returns
    -------
    solution : (n,)
    steps : int
        How many were taken.
    """
    solution, residual = np.zeros_like(load), load.copy()
    corrected = precondition(residual)
    direction = corrected
    first = left = float(residual @ corrected)
    steps = 0
    while steps < most_steps and left > tolerance**2 * first:
        product = multiply(direction)
        length = left / float(direction @ product)
        solution = solution + length * direction
        residual = residual - length * product
        corrected = precondition(residual)
        before, left = left, float(residual @ corrected)
        direction = corrected + (left / before) * direction
        steps += 1
    return solution, steps
