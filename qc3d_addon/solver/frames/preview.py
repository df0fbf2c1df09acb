# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Previews: shapes at any time, interpolated between dense frames in a fraction of a millisecond."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from .key_times import KeyTimes
from .weights import Weights

Singles = NDArray[np.float32]
EVEN = KeyTimes(np.array([0.0, 1.0]))  # two keys


class PreviewCurve:
    """A cubic spline in time through the frames of each pair, twice differentiable except at the keys.

    It stores two single-precision numbers for each coordinate of each frame.

    Parameters
    ----------
    frames : (pairs · d + 1, n, 3)
        Frames without easing, from the first key to the last, with d >= 3 even steps between every two keys.
    key_times : KeyTimes
        When the curve is at the keys. It also applies the easing, because the frames must include the keys, where the
        motion may have corners.
    """

    def __init__(self, frames: Floats, key_times: KeyTimes = EVEN) -> None:
        self._key_times, pairs = key_times, key_times.pairs
        self._steps = (len(frames) - 1) // pairs
        operator = _slope_operator(self._steps)
        self._frames = frames.astype(np.float32)
        flat = frames.reshape(len(frames), -1)
        parts = [flat[first : first + self._steps + 1] for first in range(0, len(frames) - 1, self._steps)]
        # An inner key has a slope on each side: (pairs, d + 1, n, 3).
        slopes = np.stack([operator @ part for part in parts]).astype(np.float32)
        self._slopes = slopes.reshape(pairs, self._steps + 1, *frames.shape[1:])

    @property
    def vertices(self) -> int:
        """Number of vertices n."""
        return int(self._frames.shape[1])

    @property
    def nbytes(self) -> int:
        """Memory that it keeps, in bytes."""
        return self._frames.nbytes + self._slopes.nbytes

    def at(self, time: float) -> Singles:
        """(n, 3) positions at ``time``, clamped to 0..1; the frames themselves, bit for bit, at their times."""
        along = self._key_times.along(np.clip([time], 0.0, 1.0)).item() * self._steps
        before = min(int(along), len(self._frames) - 2)
        part = np.float32(along - before)
        if part == 0.0 or part == 1.0:
            return np.array(self._frames[before + int(part)])
        pair, step = divmod(before, self._steps)
        rest = np.float32(1.0) - part
        # Hermite's basis, slopes counted per step.
        first, second = self._frames[before], self._frames[before + 1]
        blend = part * part * (np.float32(3.0) - np.float32(2.0) * part)
        result = first + blend * (second - first)
        result += (part * rest * rest) * self._slopes[pair, step]
        result -= (part * part * rest) * self._slopes[pair, step + 1]
        return np.asarray(result)

    def beyond(self, time: float, weights: Weights) -> Singles:
        """(n, 3) difference at ``time`` of the curve from what a control with these weights plays of the curve."""
        time = min(max(time, 0.0), 1.0)
        added = self.at(time)
        for weight, knot in zip(weights.at(time)[0].tolist(), weights.knots.tolist(), strict=True):
            if weight:
                added -= np.float32(weight) * self.at(knot)
        return added


def _slope_operator(steps: int) -> Floats:
    """(steps + 1, steps + 1) matrix from values at even knots to slopes of their cubic spline, not-a-knot at the ends.

    de Boor 1978, *A Practical Guide to Splines*, chapter IV.
    """
    count = steps + 1
    left, right = np.zeros((count, count)), np.zeros((count, count))
    inner = np.arange(1, steps)
    left[inner, inner - 1] = left[inner, inner + 1] = 1.0
    left[inner, inner] = 4.0
    right[inner, inner + 1], right[inner, inner - 1] = 3.0, -3.0
    left[0, :2], right[0, :3] = (1.0, 2.0), (-2.5, 2.0, 0.5)
    left[-1, -2:], right[-1, -3:] = (2.0, 1.0), (-0.5, -2.0, 2.5)
    return np.asarray(np.linalg.solve(left, right))
