# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Arcs about one center: what morph targets of modeling programs call *rotational* mixing.

The direction from the center to a vertex goes from one key to the other by the shortest arc at even speed, and the
distance from the center is blended linearly. Where there is no one arc, a vertex moves along a straight line. Cinema
4D's Pose Morph has a mixing *Rotational*, whose formula is not published; arcs about the axis of the object are what
it shows. The center is the origin of the keys' coordinates, the place of that axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .gradients import Floats


def frames(key0: Floats, key1: Floats, times: ArrayLike) -> Floats:
    """In-betweens (k, n, 3) at the times."""
    length0, length1 = (np.linalg.norm(key, axis=1, keepdims=True) for key in (key0, key1))
    first, second = (key / np.maximum(length, 1e-300) for key, length in ((key0, length0), (key1, length1)))
    # Half the angle by the sum and the difference: exact for small angles and for opposite directions.
    angle = 2.0 * np.arctan2(
        np.linalg.norm(second - first, axis=1, keepdims=True), np.linalg.norm(second + first, axis=1, keepdims=True)
    )
    sine = np.sin(angle)
    # Otherwise the arc is a line, has no one plane, or begins or ends at the center.
    bends = (sine > 1e-9) & (length0 > 0.0) & (length1 > 0.0)
    made = []
    for time in np.asarray(times, dtype=np.float64).tolist():
        safe = np.where(bends, sine, 1.0)
        before, after = (np.sin(part * angle) / safe for part in (1.0 - time, time))
        arc = ((1.0 - time) * length0 + time * length1) * (before * first + after * second)
        made.append(np.where(bends, arc, (1.0 - time) * key0 + time * key1))
    return np.stack(made)
