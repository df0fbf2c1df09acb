# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Logarithms of stretches, and stretches from these."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .nearest_map import MOST_LOGARITHM


def logarithm(stretch: Floats) -> Floats:
    """(M, 3, 3) logarithms of symmetric positive definite matrices."""
    values, vectors = np.linalg.eigh(stretch)
    return np.asarray((vectors * np.log(values)[:, None]) @ vectors.transpose(0, 2, 1))


def exponential(matrices: Floats) -> Floats:
    """(M, 3, 3) exponentials of symmetric matrices: symmetric positive definite ones."""
    values, vectors = np.linalg.eigh(matrices)
    stretches = np.exp(np.clip(values, -MOST_LOGARITHM, MOST_LOGARITHM))
    product = (vectors * stretches[:, None]) @ vectors.transpose(0, 2, 1)
    return np.asarray(0.5 * (product + product.transpose(0, 2, 1)))
