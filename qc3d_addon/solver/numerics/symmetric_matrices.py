# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetric positive definite matrices, and stretches interpolated between the identity and one of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..settings import StretchLaw
from .rotations import by_component, products

_FLATTEST = 1e-16  # of the largest eigenvalue: about one unit of rounding


@dataclass(frozen=True, eq=False)
class Stretch:
    """Symmetric positive definite matrices, stored as eigenvalues and eigenvectors, component-major.

    Parameters
    ----------
    values : (m, d)
        Eigenvalues, ascending, positive.
    vectors : (m, d, d)
        Eigenvectors in the columns.
    """

    values: Floats
    vectors: Floats

    @classmethod
    def of(cls, matrices: Floats) -> Stretch:
        """Decompose (m, d, d) symmetric positive definite matrices."""
        values, vectors = np.linalg.eigh(matrices)
        # Rounding may make the smallest eigenvalue of a nearly singular matrix negative.
        return cls(by_component(np.maximum(values, _FLATTEST * values[:, -1:])), by_component(vectors))

    def part(self, chosen: Ints | slice) -> Stretch:
        """Some of the matrices."""
        return Stretch(self.values[chosen], self.vectors[chosen])

    def at(self, time: float, law: StretchLaw) -> Floats:
        """(m, d, d) stretches at ``time`` t in 0..1: (1 - t) I + t P, or exp(t log P) under the logarithmic law."""
        return self.assembled((1.0 - time) + time * self.values if law == "linear" else self.values**time)

    def assembled(self, values: Floats) -> Floats:
        """(m, d, d) symmetric matrices with the same eigenvectors and other eigenvalues (m, d)."""
        return products(self.vectors * values[:, None, :], self.vectors.transpose(0, 2, 1))
