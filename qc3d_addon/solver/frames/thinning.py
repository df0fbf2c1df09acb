# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""As few frames as show the others closely enough."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats


def fewest_steps(frames: Floats, tolerance: float, pairs: int = 1, least: int = 1) -> int:
    """The fewest even steps between every two keys whose straight blends show all the frames.

    Parameters
    ----------
    frames : (pairs · d + 1, n, 3)
        Evenly spaced frames from the first key of all to the last, d steps for every two keys.
    tolerance
        How far a vertex may be from where its frame has it, in the unit of the frames.
    pairs
        Number of pairs of keys that the frames go through.
    least
        Smaller numbers are not looked at.

    Returns
    -------
    int
        A divisor of d; d itself where no smaller one is enough.
    """
    dense = (len(frames) - 1) // pairs
    for steps in (steps for steps in range(least, dense) if dense % steps == 0):
        if _largest_distance(frames, dense // steps) <= tolerance:
            return steps
    return dense


def missed_between(frames: Floats) -> float:
    """About how far the straight blends of frames that follow each other are from the motion between them.

    Parameters
    ----------
    frames : (k, n, 3)
        Evenly spaced frames of a smooth motion; k is odd, 3 or more.

    Returns
    -------
    float
        In the unit of the frames: a quarter of what blends of every second frame miss, since what a straight blend
        misses falls with the square of the step.
    """
    return _largest_distance(frames, 2) / 4.0


def _largest_distance(frames: Floats, stride: int) -> float:
    """How far the straight blends of every ``stride``-th frame are from the frames between them."""
    kept = frames[::stride]
    largest = 0.0
    for offset in range(1, stride):
        part = offset / stride
        blend = (1.0 - part) * kept[:-1] + part * kept[1:]
        largest = max(largest, float(np.linalg.norm(frames[offset::stride] - blend, axis=2).max()))
    return largest
