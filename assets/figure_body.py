# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo figure's left arm, and the torso that it grows from, in meters."""

from __future__ import annotations

import numpy as np
from clay import Floats, Ints, ball, joined, rod, surface
from motions import swept, turned

SHOULDER, HANG = np.array([0.37, 0.05, 0.66]), np.radians(22.0)  # where the arm starts, and how far it hangs down
ELBOW = (0.18, 0.66)  # the bend's range along the arm
CUFF = (0.745, 0.835)  # the sleeve's end
_FINGERS = (1.05, 1.30)  # the range along the arm in which fingers curl


def arm(step: float = 0.0166) -> tuple[Floats, Ints]:
    """The left arm along x, palm down and thumb forward (-y), shoulder at the origin: vertices and quads."""
    return surface(_arm, (-0.2, -0.26, -0.21), (1.36, 0.22, 0.21), step)


def bent(points: Floats) -> Floats:
    """The elbow bent by 105 degrees, the palm turned to the front."""
    return swept(points, (0.0, 0.0, 0.0), np.radians(105.0), ELBOW, np.radians(-90.0), (0.42, 0.95))


def fist(points: Floats) -> Floats:
    """The fingers curled and the thumb laid beside them."""
    fingers = (points[:, 0] > 1.0) & (np.abs(points[:, 1]) < 0.16)
    moved = points.copy()
    moved[fingers] = swept(points[fingers], (0.0, 0.0, 0.0), np.radians(-165.0), _FINGERS)
    along = np.clip((-points[:, 1] - 0.085) / 0.12, 0.0, 1.0) * (points[:, 0] > 0.85) * (points[:, 0] <= 1.06)
    return np.where(fingers[:, None], moved, turned(points, (0.93, -0.08, 0.0), (0.0, 0.0, 1.0), 0.6 * along))


def placed(points: Floats) -> Floats:
    """Points of the arm where it belongs on the figure."""
    x, y, z = points.T
    turned_ = np.stack([np.cos(HANG) * x + np.sin(HANG) * z, y, np.cos(HANG) * z - np.sin(HANG) * x], axis=1)
    return turned_ + SHOULDER


def torso() -> tuple[Floats, Ints]:
    """The sweater: chest and the right sleeve, cut off level."""
    return surface(_torso, (-0.72, -0.42, -0.05), (0.62, 0.46, 1.02), 0.036)


def collar() -> tuple[Floats, Ints]:
    """The sweater's collar."""

    def field(points: Floats) -> Floats:
        away = np.hypot(points[:, 0], points[:, 1] - 0.065) - 0.225
        return np.hypot(away, np.maximum(np.abs(points[:, 2] - 0.86) - 0.045, 0.0)) - 0.045

    return surface(field, (-0.32, -0.26, 0.74), (0.32, 0.39, 0.98), 0.026)


def _arm(points: Floats) -> Floats:
    shape = rod(points, (0.0, 0.0, 0.0), (0.42, 0.0, 0.0), 0.14, 0.104)
    shape = joined(shape, rod(points, (0.42, 0.0, 0.0), (0.74, 0.0, 0.0), 0.104, 0.096), 0.05)
    ring = rod(points, (0.772, 0.0, 0.0), (0.808, 0.0, 0.0), 0.108, 0.108)
    shape = joined(shape, np.maximum(ring, np.abs(points[:, 0] - 0.79) - 0.045), 0.02)
    hand = joined(rod(points, (0.76, 0.0, 0.0), (0.92, 0.0, 0.0), 0.066, 0.062),
                  ball(points, (1.0, 0.005, 0.0), (0.12, 0.12, 0.062)), 0.05)  # fmt: skip
    for side, length, spread in ((-0.078, 0.2, -0.02), (0.004, 0.225, 0.002), (0.086, 0.19, 0.024)):
        finger = rod(points, (1.04, side, 0.0), (1.06 + length, side + spread, 0.0), 0.041, 0.037)
        hand = joined(hand, finger, 0.018)
    thumb = joined(rod(points, (0.93, -0.05, 0.0), (0.975, -0.13, -0.005), 0.052, 0.045),
                   rod(points, (0.975, -0.13, -0.005), (1.04, -0.19, -0.005), 0.045, 0.038), 0.02)  # fmt: skip
    return joined(shape, joined(hand, thumb, 0.03), 0.012)


def _torso(points: Floats) -> Floats:
    shape = ball(points, (0.0, 0.06, 0.2), (0.43, 0.3, 0.6))
    shape = joined(shape, rod(points, (-0.3, 0.05, 0.64), (0.3, 0.05, 0.64), 0.17, 0.17), 0.15)
    sleeve = rod(points, (-0.37, 0.05, 0.64), (-0.55, 0.0, 0.0), 0.15, 0.125)
    shape = joined(shape, sleeve, 0.04)
    return np.maximum(shape, -points[:, 2])
