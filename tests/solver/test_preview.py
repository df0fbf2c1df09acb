# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview's curve: exact where it must be, smooth, and near the frames it does not know."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from qc3d_addon.solver.preview import PreviewCurve

RANDOM = np.random.default_rng(0)


def test_the_frames_themselves() -> None:
    frames = RANDOM.normal(size=(13, 7, 3))
    curve = PreviewCurve(frames, pairs=3)
    for number, frame in enumerate(frames):
        np.testing.assert_array_equal(curve.at(number / 12), frame.astype(np.float32))
    np.testing.assert_array_equal(curve.at(-1.0), frames[0].astype(np.float32))
    np.testing.assert_array_equal(curve.at(2.0), frames[-1].astype(np.float32))
    assert curve.vertices == 7


@given(st.integers(3, 48), st.floats(0.0, 1.0), st.integers(0, 2**32 - 1))
def test_the_cubic_spline(steps: int, time: float, seed: int) -> None:
    frames = np.random.default_rng(seed).normal(size=(steps + 1, 2, 3))
    expected = CubicSpline(np.linspace(0.0, 1.0, steps + 1), frames)(time)
    np.testing.assert_allclose(PreviewCurve(frames).at(time), expected, atol=2e-5)


def test_every_pair_has_its_own_spline() -> None:
    times = np.linspace(0.0, 2.0, 13)
    # Cubic on either side of the key in the middle, where it turns a corner.
    frames = np.where(times < 1.0, times**3, (2.0 - times) ** 3)[:, None, None] * np.ones((1, 2, 3))
    curve = PreviewCurve(frames, pairs=2)
    for time in (0.31, 0.49, 0.51, 0.83):
        along = 2.0 * time
        expected = along**3 if along < 1.0 else (2.0 - along) ** 3
        np.testing.assert_allclose(curve.at(time), expected, atol=1e-6)


@pytest.mark.parametrize("steps", [12, 24, 48])
def test_an_arc_is_met_to_the_fourth_order(steps: int) -> None:
    def arc(times: np.ndarray) -> np.ndarray:
        turns = 0.5 * np.pi * times
        return np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=-1)[:, None, :]

    curve = PreviewCurve(arc(np.linspace(0.0, 1.0, steps + 1)))
    times = np.linspace(0.0, 1.0, 301)
    error = max(np.abs(curve.at(time) - arc(np.array([time]))[0]).max() for time in times)
    assert error < 0.2 * (0.5 * np.pi / steps) ** 4 + 2e-7
