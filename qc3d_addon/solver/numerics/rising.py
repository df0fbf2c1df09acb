# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Thresholds without a corner: what depends on them changes gradually with the keys and with time."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats


def risen(values: Floats | float, low: float, high: float) -> Floats:
    """0 up to ``low``, 1 from ``high`` on, rising smoothly between them; the other way round if ``high`` is below.

    Examples
    --------
    >>> risen(np.array([0.0, 1.0, 1.5, 3.0]), 1.0, 2.0)
    array([0. , 0. , 0.5, 1. ])
    """
    part = np.clip((np.asarray(values) - low) / (high - low), 0.0, 1.0)
    return np.asarray(part * part * (3.0 - 2.0 * part))
