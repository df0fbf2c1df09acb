# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of closed components with several keys on: somewhere between their changes added and multiplied."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats

# Of the base's volume: where adding and multiplying differ by less, changes are added; twice as far apart, all between
# them is right. The smaller one is not seen.
_SEEN = 0.005


def volume_off_range(volumes: Floats, base: Floats, alone: Sequence[Floats]) -> Floats:
    """How far volumes of components are beyond what the keys' own changes explain, in the volumes' unit; 0 if nowhere.

    Keys that change different places add their changes: V = V0 + (V1 - V0) + (V2 - V0). Keys that stretch the same
    place in different directions multiply them: V = V0 (V1 / V0) (V2 / V0), as width and height of a box do. Nothing
    tells how much of each there is: everything between them is right. Both are the same to first order, so that changes
    are simply added where the difference would not be seen.

    Parameters
    ----------
    volumes : (c,)
        Volumes with all keys on.
    base : (c,)
        Volumes of the base; without one, changes are added.
    alone : sequence of (c,)
        Volumes with each key on alone.

    Returns
    -------
    (c,)
        Positive where a volume is too large, negative where it is too small.

    Examples
    --------
    >>> import numpy as np
    >>> box, higher, wider = np.array([1.0]), np.array([2.0]), np.array([2.0])
    >>> volume_off_range(np.array([4.0]), box, [higher, wider])
    array([0.])
    >>> volume_off_range(np.array([4.5]), box, [higher, wider])
    array([0.5])
    >>> volume_off_range(np.array([1.021]), box, [np.array([1.01]), np.array([1.01])]).round(6)
    array([0.001])
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = [np.where(base != 0.0, value / base, 1.0) for value in alone]
    added = base + sum((value - base for value in alone), start=np.zeros_like(base))
    multiplied = np.where(base != 0.0, base * np.prod(ratios, axis=0), added)
    apart = np.abs(multiplied - added)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.clip(np.where(base != 0.0, apart / (_SEEN * np.abs(base)), 0.0) - 1.0, 0.0, 1.0)
    other = added + share * (multiplied - added)
    return np.asarray(volumes - np.clip(volumes, np.minimum(added, other), np.maximum(added, other)))
