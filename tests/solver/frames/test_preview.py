# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview's curve: exact at its frames, smooth, and close to frames that it does not know."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from qc3d_addon.solver.frames.easing import eased
from qc3d_addon.solver.frames.preview import PreviewCurve
from qc3d_addon.solver.settings import Easing

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


@pytest.mark.parametrize("easing", ["ease-in", "ease-out", "ease-in-out"])
def test_easing_is_when_and_not_where(easing: Easing) -> None:
    frames = RANDOM.normal(size=(13, 7, 3))
    times = np.linspace(0.0, 1.0, 31)
    curve, eased_curve = PreviewCurve(frames, 2), PreviewCurve(frames, 2, easing)
    for time, passed in zip(times, eased(times, easing), strict=True):
        np.testing.assert_array_equal(eased_curve.at(time), curve.at(passed))


@given(st.integers(1, 30), st.floats(-0.5, 1.5))
def test_beyond_the_straight_blend(steps: int, time: float) -> None:
    curve = PreviewCurve(np.random.default_rng(steps).normal(size=(9, 4, 3)))
    nodes = np.linspace(0.0, 1.0, steps + 1)
    hats = np.maximum(0.0, 1.0 - np.abs(np.clip(time, 0.0, 1.0) * steps - np.arange(steps + 1)))
    blend = np.tensordot(hats, np.stack([curve.at(node) for node in nodes]), axes=1)
    np.testing.assert_allclose(curve.beyond_blend(time, steps), curve.at(time) - blend, atol=5e-5)


def test_nothing_is_beyond_the_steps_themselves() -> None:
    curve = PreviewCurve(RANDOM.normal(size=(9, 4, 3)))
    for step in range(8):
        assert not curve.beyond_blend(step / 7, 7).any()
    assert not curve.beyond_blend(1.0, 7).any()
    assert curve.beyond_blend(0.5, 7).any()
