# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stretches between the identity and a given symmetric matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..settings import StretchLaw
from .rotations import by_component, products

_FLATTEST = 1e-16


@dataclass(frozen=True, eq=False)
class Stretch:
    """Symmetric positive definite matrices by their eigenvalues (m, d) and eigenvectors (m, d, d), by component."""

    values: Floats
    vectors: Floats

    @classmethod
    def of(cls, matrices: Floats) -> Stretch:
        """Decompose (m, d, d) symmetric positive definite matrices."""
        values, vectors = np.linalg.eigh(matrices)
        # Where something is flattened as far as numbers go, rounding must not make it negative.
        return cls(by_component(np.maximum(values, _FLATTEST * values[:, -1:])), by_component(vectors))

    def at(self, time: float, law: StretchLaw) -> Floats:
        """(m, d, d) stretches at ``time``: (1 - t) I + t P, or exp(t log P); positive definite for t in 0..1."""
        return self.assembled((1.0 - time) + time * self.values if law == "linear" else self.values**time)

    def assembled(self, values: Floats) -> Floats:
        """(m, d, d) symmetric matrices with these eigenvectors and other eigenvalues (m, d)."""
        return products(self.vectors * values[:, None, :], self.vectors.transpose(0, 2, 1))
