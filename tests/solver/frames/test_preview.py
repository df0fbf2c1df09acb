# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview's curve: exact at its frames, smooth, and close to frames that it does not know."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.frames.easing import eased
from qc3d_addon.solver.frames.key_times import KeyTimes
from qc3d_addon.solver.frames.preview import PreviewCurve
from qc3d_addon.solver.frames.weights import Weights
from qc3d_addon.solver.settings import Easing, FrameOptions

RANDOM = np.random.default_rng(0)


def even(pairs: int, easing: Easing = "linear") -> KeyTimes:
    return KeyTimes.of(FrameOptions(easing=easing), pairs)


def test_the_frames_themselves() -> None:
    frames = RANDOM.normal(size=(13, 7, 3))
    curve = PreviewCurve(frames, even(3))
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
    curve = PreviewCurve(frames, even(2))
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
    curve, eased_curve = PreviewCurve(frames, even(2)), PreviewCurve(frames, even(2, easing))
    for time, passed in zip(times, eased(times, easing), strict=True):
        np.testing.assert_array_equal(eased_curve.at(time), curve.at(passed))


def test_keys_at_times_of_their_own() -> None:
    frames = RANDOM.normal(size=(13, 7, 3))
    curve = PreviewCurve(frames, KeyTimes.of(FrameOptions(via_at=(0.2, 0.5)), 3))
    for time, number in ((0.0, 0), (0.1, 2), (0.2, 4), (0.35, 6), (0.5, 8), (0.75, 10), (1.0, 12)):
        np.testing.assert_allclose(curve.at(time), frames[number], atol=1e-6)


@pytest.mark.parametrize("kind", [Weights.hats, Weights.smooth])
@given(st.integers(1, 30), st.floats(-0.5, 1.5))
def test_beyond_what_weights_play(kind: Callable[[Floats], Weights], steps: int, time: float) -> None:
    curve = PreviewCurve(np.random.default_rng(steps).normal(size=(9, 4, 3)))
    weights = kind(np.linspace(0.0, 1.0, steps + 1))
    clamped = min(max(time, 0.0), 1.0)
    played = weights.played(np.stack([curve.at(knot) for knot in weights.knots]), [clamped])[0]
    np.testing.assert_allclose(curve.beyond(time, weights), curve.at(time) - played, atol=5e-5)


def test_nothing_is_beyond_the_knots_themselves() -> None:
    curve = PreviewCurve(RANDOM.normal(size=(9, 4, 3)))
    weights = Weights.hats(np.linspace(0.0, 1.0, 8))
    for knot in weights.knots.tolist():
        assert np.abs(curve.beyond(knot, weights)).max() < 1e-6
    assert curve.beyond(0.5, weights).any()
