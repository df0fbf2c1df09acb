# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A tolerance keeps as few frames as it needs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.frames.thinning import fewest_steps, missed_between


def arc(steps: int, angle: float = np.pi / 2.0) -> Floats:
    """A point on a circle of radius 1 and one that stays."""
    turns = np.linspace(0.0, angle, steps + 1)
    moving = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(steps + 1)])
    return np.stack([moving, np.zeros((steps + 1, 3))], axis=1)


@pytest.mark.parametrize(("tolerance", "steps"), [(0.3, 1), (0.08, 2), (0.036, 3), (0.02, 4), (1e-9, 48)])
def test_chords_of_an_arc(tolerance: float, steps: int) -> None:
    # A chord over the angle a is 1 - cos(a / 2) away from its arc.
    assert 1.0 - np.cos(np.pi / 4.0 / steps) < tolerance or steps == 48
    assert fewest_steps(arc(48), tolerance) == steps


@pytest.mark.parametrize(("least", "steps"), [(1, 2), (2, 2), (3, 3), (5, 6), (48, 48)])
def test_a_smallest_number(least: int, steps: int) -> None:
    assert fewest_steps(arc(48), 0.08, least=least) == steps


def test_a_straight_motion_needs_no_in_between() -> None:
    frames = np.linspace(0.0, 1.0, 25)[:, None, None] * np.ones((1, 5, 3))
    assert fewest_steps(frames, 1e-12) == 1


@pytest.mark.parametrize("steps", [12, 48])
def test_what_the_closest_chords_miss(steps: int) -> None:
    assert missed_between(arc(steps)) == pytest.approx(1.0 - np.cos(np.pi / 4.0 / steps), rel=0.01)


def test_the_hardest_pair_of_a_chain_decides() -> None:
    straight = np.linspace(0.0, 1.0, 25)[1:, None, None] * np.array([0.0, 0.0, 1.0])
    bent = arc(24)
    frames = np.concatenate([bent, bent[-1] + straight])
    assert fewest_steps(frames, 0.08, pairs=2) == fewest_steps(bent, 0.08) == 2


@given(st.sampled_from([6, 12, 30, 48]), st.integers(1, 3), st.floats(1e-4, 1.0), st.integers(0, 2**32 - 1))
def test_what_is_chosen_is_near_enough_and_nothing_coarser_is(
    dense: int, pairs: int, tolerance: float, seed: int
) -> None:
    frames = np.cumsum(np.random.default_rng(seed).normal(scale=0.05, size=(pairs * dense + 1, 4, 3)), axis=0)

    def distance(steps: int) -> float:
        places = np.linspace(0.0, pairs * steps, pairs * dense + 1)
        before = np.minimum(places.astype(int), pairs * steps - 1)
        kept, part = frames[:: dense // steps], (places - before)[:, None, None]
        blends = (1.0 - part) * kept[before] + part * kept[before + 1]
        return float(np.linalg.norm(blends - frames, axis=2).max())

    found = fewest_steps(frames, tolerance, pairs)
    assert found == dense or distance(found) <= tolerance * (1.0 + 1e-9)
    for coarser in (steps for steps in range(1, found) if dense % steps == 0):
        assert distance(coarser) > tolerance * (1.0 - 1e-9)
