# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Preconditioned conjugate gradients that stop by the norm of the preconditioned residual.

The common ending, by the plain residual, is too early for stiff systems: the first step meets the stiffest equations,
and what is left of the others hardly shows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Floats

Product = Callable[[Floats], Floats]


def conjugate_gradients(
    multiply: Product, precondition: Product, load: Floats, tolerance: float, steps: tuple[int, int]
) -> tuple[Floats, int]:
    """Solve A x = load for a symmetric positive definite A.

    Parameters
    ----------
    multiply, precondition : callable
        Functions of vectors x (n,): A x, and a symmetric positive definite approximation of A⁻¹ x.
    load : (n,)
    tolerance : float
        With the residual r and the preconditioner M, the iteration stops when rᵀ M⁻¹ r has decreased by the square of
        this.
    steps : (int, int)
        Smallest number of iterations, unless the residual vanishes, and largest number.

    Returns
    -------
    solution : (n,)
    taken : int
        Number of iterations.
    """
    solution, residual = np.zeros_like(load), load.copy()
    corrected = precondition(residual)
    direction = corrected
    first = left = float(residual @ corrected)
    taken = 0
    while taken < steps[1] and left > (tolerance**2 * first if taken >= steps[0] else 0.0):
        product = multiply(direction)
        length = left / float(direction @ product)
        solution = solution + length * direction
        residual = residual - length * product
        corrected = precondition(residual)
        before, left = left, float(residual @ corrected)
        direction = corrected + (left / before) * direction
        taken += 1
    return solution, taken
