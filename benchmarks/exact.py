# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact in-betweens of a bar that is twisted or bent, as a yardstick.

The bar stands along z around the origin. ``twist``: a cross-section at height h above the lower end turns about z by
the fraction h / length of the angle. ``bend``: the center line becomes an arc of the same length in the x-z plane, and
its middle stays in place.
"""

from __future__ import annotations

import re

import numpy as np

from .catalogue import Floats, Pair


def twisted(straight: Floats, angle: float) -> Floats:
    """The bar (n, 3) twisted by the angle (radians) from its lower to its upper end."""
    x, y, z = straight.T
    turn = angle * (z - z.min()) / np.ptp(z)
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=1)


def bent(straight: Floats, angle: float) -> Floats:
    """The bar (n, 3) bent so that its ends enclose the angle (radians); 0 leaves it straight."""
    if angle == 0.0:
        return straight.copy()
    x, y, z = straight.T
    radius = np.ptp(z) / angle
    turn = z / radius
    return np.stack([radius - (radius - x) * np.cos(turn), y, (radius - x) * np.sin(turn)], axis=1)


def exact_shape(pair: Pair, straight: Floats, time: float) -> Floats | None:
    """The exact in-between of the pair at the time; None if it is not known."""
    match = re.fullmatch(r"(twist|bend)(\d+)", pair.second)
    if pair.file != "bar" or pair.first != "straight" or match is None:
        return None
    motion = {"twist": twisted, "bend": bent}[match[1]]
    return motion(straight, time * np.radians(float(match[2])))
