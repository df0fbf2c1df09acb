# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of a control: what they reproduce exactly, and how close they come to a known motion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.weights import Weights, fewest_knots

EVERYWHERE = np.linspace(-0.5, 1.5, 81)


@st.composite
def knots(draw: st.DrawFn) -> Floats:
    inner = draw(st.lists(st.integers(1, 99), unique=True, max_size=8))
    return np.array([0, *sorted(inner), 100]) / 100.0


@given(knots())
def test_what_every_set_of_weights_is(places: Floats) -> None:
    for weights in (Weights.smooth(places), Weights.hats(places), Weights.smooth(places, range(1, len(places) - 1, 2))):
        found = weights.at(EVERYWHERE)
        np.testing.assert_allclose(weights.at(places), np.eye(len(places)), atol=1e-12)
        scale = np.abs(found).max()
        np.testing.assert_allclose(found.sum(axis=1), 1.0, atol=1e-12 * scale)
        # A motion along a straight line is played as it is, beyond its ends too.
        np.testing.assert_allclose(found @ places, EVERYWHERE, atol=1e-12 * scale)


@given(knots())
def test_smooth_weights_are_the_spline_of_scipy(places: Floats) -> None:
    wanted = CubicSpline(places, np.eye(len(places)))(places, 1)
    for slopes in Weights.smooth(places).slopes:
        np.testing.assert_allclose(slopes, wanted, rtol=0.0, atol=1e-11 * max(1.0, np.abs(wanted).max()))


@pytest.mark.parametrize("count", [4, 5, 9])
def test_cubic_motions_are_played_exactly(count: int) -> None:
    places = np.sort(np.random.default_rng(count).uniform(size=count))
    inside = np.linspace(places[0], places[-1], 33)
    curve = np.polynomial.Polynomial([0.3, -1.0, 2.0, 1.7])
    np.testing.assert_allclose(Weights.smooth(places).at(inside) @ curve(places), curve(inside), atol=1e-10)


def test_no_corner_but_where_one_is_asked_for() -> None:
    places = np.linspace(0.0, 1.0, 5)
    before, after = Weights.smooth(places).slopes
    np.testing.assert_allclose(before, after, atol=1e-12)
    before, after = Weights.smooth(places, [2]).slopes
    np.testing.assert_allclose(np.delete(before, 2, axis=0), np.delete(after, 2, axis=0), atol=1e-12)
    assert np.abs(before[2] - after[2]).max() > 1.0
    # Each side of the corner is that of its own shapes.
    assert not before[:3, 3:].any()
    assert not after[2:, :2].any()


def turning(times: Floats, angle: float) -> Floats:
    """A point that goes round a circle, and one that stays in its middle."""
    turned = np.stack([np.cos(angle * times), np.sin(angle * times), 0.0 * times], axis=1)
    return np.stack([turned, 0.0 * turned], axis=1)


def test_three_smooth_in_betweens_do_what_eleven_hats_do_not() -> None:
    times = np.linspace(0.0, 1.0, 49)
    frames = turning(times, np.radians(120.0))

    def missed(weights: Weights) -> float:
        played = weights.played(turning(weights.knots, np.radians(120.0)), times)
        return float(np.linalg.norm(played - frames, axis=2).max())

    assert missed(Weights.smooth(np.linspace(0, 1, 5))) < missed(Weights.hats(np.linspace(0, 1, 13)))
    assert missed(Weights.smooth(np.linspace(0, 1, 5))) < 0.003 < 0.03 < missed(Weights.hats(np.linspace(0, 1, 5)))


@pytest.mark.parametrize("knots", [[0.0], [0.0, 0.0, 1.0], [0.0, np.nan, 1.0], [1.0, 0.0], [[0.0, 1.0]]])
def test_positions_that_are_none_are_refused(knots: object) -> None:
    with pytest.raises(InputError, match="increasing order"):
        Weights.smooth(knots)


class TestFewestKnots:
    TIMES = np.linspace(0.0, 1.0, 49)

    def missed(self, frames: Floats, chosen: np.ndarray, corners: tuple[int, ...] = ()) -> float:
        weights = Weights.smooth(self.TIMES[chosen], [chosen.tolist().index(corner) for corner in corners])
        return float(np.linalg.norm(weights.played(frames[chosen], self.TIMES) - frames, axis=2).max())

    def test_a_straight_motion_needs_none(self) -> None:
        frames = self.TIMES[:, None, None] * np.ones((2, 3))
        assert fewest_knots(self.TIMES, frames, 1e-9).tolist() == [0, 48]

    @pytest.mark.parametrize("tolerance", [0.1, 0.01, 1e-3, 1e-4])
    def test_a_turn(self, tolerance: float) -> None:
        frames = turning(self.TIMES, np.radians(170.0))
        chosen = fewest_knots(self.TIMES, frames, tolerance)
        assert self.missed(frames, chosen) <= tolerance
        evenly = [np.linspace(0, 48, count).round().astype(int) for count in range(2, 49)]
        assert len(chosen) <= min(len(even) for even in evenly if self.missed(frames, even) <= tolerance)

    def test_in_betweens_are_where_the_path_bends(self) -> None:
        late = np.clip(self.TIMES - 0.7, 0.0, None) / 0.3
        frames = turning(late**2, np.radians(120.0))
        chosen = fewest_knots(self.TIMES, frames, 2e-3)
        assert self.missed(frames, chosen) <= 2e-3
        assert np.count_nonzero(self.TIMES[chosen] > 0.6) > len(chosen) / 2

    def test_a_corner_at_a_key(self) -> None:
        frames = np.concatenate([turning(2.0 * self.TIMES[:24], 1.0), turning(2.0 - 2.0 * self.TIMES[24:], 1.0)])
        chosen = fewest_knots(self.TIMES, frames, 1e-3, [24], [24])
        assert 24 in chosen
        assert self.missed(frames, chosen, (24,)) <= 1e-3
        assert len(chosen) < 10

    def test_noise_takes_them_all(self) -> None:
        frames = np.random.default_rng(0).normal(size=(49, 2, 3))
        assert fewest_knots(self.TIMES, frames, 1e-9).tolist() == list(range(49))
