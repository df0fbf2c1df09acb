# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Easing curves: the fraction of the motion that is done at each time."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..settings import Easing


def eased(times: Floats, easing: Easing) -> Floats:
    """(k,) fraction of the motion, 0..1, that is done at ``times`` (k,) in 0..1.

    ``ease-in`` starts slowly and ``ease-out`` ends slowly (quadratic); ``ease-in-out`` does both (cubic).

    Examples
    --------
    >>> eased(np.array([0.0, 0.5, 1.0]), "ease-in")
    array([0.  , 0.25, 1.  ])
    """
    if easing == "ease-in":
        return np.asarray(times**2)
    if easing == "ease-out":
        return np.asarray(times * (2.0 - times))
    if easing == "ease-in-out":
        return np.asarray(times**2 * (3.0 - 2.0 * times))
    return times


def uneased(parts: Floats, easing: Easing) -> Floats:
    """(k,) times, 0..1, at which the fractions ``parts`` (k,) of the motion are done: the inverse of ``eased``."""
    if easing == "ease-in":
        return np.asarray(np.sqrt(parts))
    if easing == "ease-out":
        return np.asarray(1.0 - np.sqrt(1.0 - parts))
    if easing == "ease-in-out":
        middle = 0.5 - np.sin(np.arcsin(1.0 - 2.0 * parts) / 3.0)
        return np.where((parts > 0.0) & (parts < 1.0), middle, parts)
    return parts
