# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Easing curves: how far along the way an in-between is at a time."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..settings import Easing


def eased(times: Floats, easing: Easing) -> Floats:
    """(k,) part of the way, 0..1, at ``times`` (k,) in 0..1; 0 and 1 stay as they are.

    ``ease-in`` starts slowly and ``ease-out`` ends slowly (quadratic); ``ease-in-out`` does both (cubic).
    """
    if easing == "ease-in":
        return np.asarray(times**2)
    if easing == "ease-out":
        return np.asarray(times * (2.0 - times))
    if easing == "ease-in-out":
        return np.asarray(times**2 * (3.0 - 2.0 * times))
    return times


def uneased(parts: Floats, easing: Easing) -> Floats:
    """(k,) times, 0..1, at which ``eased`` has come to ``parts`` (k,) of the way."""
    if easing == "ease-in":
        return np.asarray(np.sqrt(parts))
    if easing == "ease-out":
        return np.asarray(1.0 - np.sqrt(1.0 - parts))
    if easing == "ease-in-out":
        middle = 0.5 - np.sin(np.arcsin(1.0 - 2.0 * parts) / 3.0)
        return np.where((parts > 0.0) & (parts < 1.0), middle, parts)
    return parts
