# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The course of a chain: smooth curves through all keys, which frames follow in the large."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.frames.course import Course, courses, shares_of_turns, spline_velocities
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from ..baking import frames_of
from ..meshes import bent, box_surface

KEYS = np.random.default_rng(1).normal(size=(5, 7, 3))
NO_REST = np.zeros(KEYS.shape[:2], dtype=bool)
EVEN = np.full(4, 0.25)
BAR, FACES = box_surface((2, 2, 10), (1.0, 1.0, 5.0))


def along(parts: list[Course], times: Floats) -> Floats:
    """Places at times (k,) in 0..1 along all parts, of equal duration."""
    numbers = np.minimum((times * len(parts)).astype(int), len(parts) - 1)
    return np.stack([parts[k].at(time * len(parts) - k) for k, time in zip(numbers, times, strict=True)])


def test_even_keys_have_the_natural_cubic_spline() -> None:
    parts = courses(KEYS, EVEN, [NO_REST[0]] * 4, [np.ones(7)] * 4)
    times = np.linspace(0.0, 1.0, 33)
    spline = CubicSpline(np.linspace(0.0, 1.0, 5), KEYS, bc_type="natural")
    np.testing.assert_allclose(along(parts, times), spline(times), rtol=0.0, atol=1e-12)


def test_what_stands_between_two_keys_stands_there_and_arrives_without_a_speed() -> None:
    keys = KEYS.copy()
    keys[2, :3] = keys[1, :3]
    still = [np.zeros(7, dtype=bool) for _ in range(4)]
    still[1][:3] = True
    parts = courses(keys, EVEN, still, [np.ones(7)] * 4)
    np.testing.assert_array_equal(parts[1].at(0.37)[:3], keys[1, :3])
    for slopes in (parts[0].slopes[1], parts[2].slopes[0]):
        assert np.abs(slopes[:3]).max() == 0.0 < np.abs(slopes[3:]).min()


def test_a_short_pair_beside_a_long_one_does_not_make_it_overshoot() -> None:
    line = np.array([0.0, 1.0, 2.0])[:, None, None] * np.ones((1, 1, 3))
    durations = np.array([1.0, 0.01])
    parts = courses(line, durations, [np.zeros(1, dtype=bool)] * 2, [np.ones(1)] * 2)
    places = np.stack([part.at(time) for part in parts for time in np.linspace(0.0, 1.0, 21)])
    assert places.min() > -0.2
    assert places.max() < 2.2
    natural = CubicSpline([0.0, 1.0, 1.01], line, bc_type="natural")(np.linspace(0.0, 1.0, 21))
    assert natural.min() < -5.0


@pytest.mark.parametrize("seed", range(3))
def test_velocities_go_with_the_keys(seed: int) -> None:
    random = np.random.default_rng(seed)
    durations = random.uniform(0.1, 1.0, 4)
    turn = rotation_matrices(random.normal(size=(1, 3)))[0]
    moved = 2.5 * KEYS @ turn.T + random.normal(size=3)
    expected = 2.5 * spline_velocities(KEYS, durations, NO_REST) @ turn.T
    np.testing.assert_allclose(spline_velocities(moved, durations, NO_REST), expected, rtol=0.0, atol=1e-12)


def test_what_turns_far_follows_less() -> None:
    triangles = np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8]])
    shares = shares_of_turns(np.radians([50.0, 90.0, 130.0]), np.ones(3), triangles, 10)
    np.testing.assert_allclose(shares, [1, 1, 1, 0.5, 0.5, 0.5, 0, 0, 0, 1], rtol=0.0, atol=1e-12)


def chain(keys: list[Floats]) -> Floats:
    fits = [finish(fit_pair(KeyPair.checked(*pair, FACES), FitOptions())) for pair in pairwise(keys)]
    return frames_of(fits, np.linspace(0.0, 1.0, 3 * len(fits) + 1)).frames


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_volume")
class TestFrames:
    def test_a_motion_that_speeds_up_is_nearer_to_the_truth_than_straight_lines_and_keeps_lengths(self) -> None:
        angles = np.radians(100.0 * np.linspace(0.0, 1.0, 10) ** 2)
        truth = np.stack([BAR if angle == 0.0 else bent(BAR, float(angle)) for angle in angles])
        frames = chain(list(truth[::3]))
        straight = np.stack([np.interp(np.arange(10.0), np.arange(0.0, 10.0, 3.0), row) for row in
                             truth[::3].reshape(4, -1).T], axis=1).reshape(truth.shape)  # fmt: skip
        off, blend = (np.sqrt(((made - truth) ** 2).sum(axis=2).mean()) for made in (frames, straight))
        assert off < 0.4 * blend
        sides = np.concatenate([FACES[:, [0, 1]], FACES[:, [1, 2]]])
        lengths = [np.linalg.norm(np.diff(made[:, sides], axis=2)[:, :, 0], axis=2) for made in (frames, truth)]
        assert np.percentile(np.abs(lengths[0] / lengths[1] - 1.0), 99) < 0.01

    def test_keys_that_are_moved_turned_and_scaled_have_frames_that_are(self) -> None:
        keys = [BAR, bent(BAR, 0.7), bent(BAR, 1.2)]
        turn = rotation_matrices(np.array([[0.4, 1.0, -0.3]]))[0]
        moved = chain([3.0 * key @ turn.T + [5.0, -2.0, 1.0] for key in keys])
        expected = 3.0 * chain(keys) @ turn.T + [5.0, -2.0, 1.0]
        assert np.abs(moved - expected).max() < 1e-7 * 15.0
