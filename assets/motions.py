# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How points of the demo figures move from one key to the next; what does not move stays exactly where it is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from clay import Floats


def rise(values: Floats, start: float, end: float) -> Floats:
    """From 0 below ``start`` to 1 above ``end``, with two continuous derivatives."""
    t = np.clip((values - start) / (end - start), 0.0, 1.0)
    return np.asarray(t**3 * (10.0 - 15.0 * t + 6.0 * t**2))


def turned(points: Floats, pivot: Sequence[float], axis: Sequence[float], angles: Floats) -> Floats:
    """Each point turned about the same line by an angle of its own, in radians."""
    moved = points.copy()
    moving = angles != 0.0
    offset, direction = points[moving] - np.array(pivot), np.array(axis)
    cosine, sine = np.cos(angles[moving, None]), np.sin(angles[moving, None])
    moved[moving] = (
        np.array(pivot)
        + cosine * offset
        + sine * np.cross(direction, offset)
        + (1.0 - cosine) * (offset @ direction)[:, None] * direction
    )
    return moved


def swept(
    points: Floats,
    origin: Sequence[float],
    bend: float,
    bends: tuple[float, float],
    twist: float = 0.0,
    twists: tuple[float, float] = (0.0, 1.0),
) -> Floats:
    """A limb along x, bent upwards and twisted about itself, without thinning or folding it.

    Each cross-section moves rigidly along the bent axis. The bend, in radians, is spread over x - origin in ``bends``
    and the twist over ``twists``; what lies before both does not move at all.
    """
    stations = np.linspace(0.0, 4.0, 4001)
    angles = bend * rise(stations, *bends)
    steps = 0.5 * np.diff(stations) * np.stack([np.cos(angles[1:]) + np.cos(angles[:-1]),
                                                np.sin(angles[1:]) + np.sin(angles[:-1])])  # fmt: skip
    along, up = np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1)

    moved = points.copy()
    first = min(bends[0] if bend else np.inf, twists[0] if twist else np.inf)
    limb = points[:, 0] - origin[0] > first
    x, y, z = (points[limb] - np.array(origin)).T
    turn = twist * rise(x, *twists)
    y, z = np.cos(turn) * y - np.sin(turn) * z, np.sin(turn) * y + np.cos(turn) * z
    angle = bend * rise(x, *bends)
    axis_x, axis_z = np.interp(x, stations, along), np.interp(x, stations, up)
    moved[limb] = np.array(origin) + np.stack([axis_x - np.sin(angle) * z, y, axis_z + np.cos(angle) * z], axis=1)
    return moved
