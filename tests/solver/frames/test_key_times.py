# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of the keys of a chain: where they are, and a motion through them without a jerk."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.frames.chain import chain_frames
from qc3d_addon.solver.frames.key_times import KeyTimes
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import Easing, FitOptions, FrameOptions
from qc3d_addon.solver.support.progress import finish

from ..meshes import bent, box_surface, twisted

pytestmark = pytest.mark.usefixtures("coarse_volume")
BAR, FACES = box_surface((2, 2, 12), (1.0, 1.0, 5.0))


@pytest.fixture(scope="module")
def keys() -> list[Floats]:
    return [BAR, bent(BAR, np.radians(60.0)), twisted(BAR, np.radians(70.0))]


def fits_of(keys: list[Floats]) -> list[FittedMap]:
    return [finish(fit_pair(KeyPair.checked(*ends, FACES), FitOptions())) for ends in pairwise(keys)]


def frames(parts: list[FittedMap], times: Floats, options: FrameOptions) -> Floats:
    return finish(chain_frames([part.pair for part in parts], parts, times, options)).frames


@pytest.mark.parametrize("easing", ["linear", "ease-in", "ease-out", "ease-in-out"])
def test_every_pair_fills_its_own_time(easing: Easing) -> None:
    times = KeyTimes.of(FrameOptions(easing=easing, via_at=(0.2, 0.3)), 3)
    segments, local = times.split(times.at)
    assert segments.tolist() == [0, 1, 2, 2]
    assert local.tolist() == [0.0, 0.0, 0.0, 1.0]
    assert times.durations.sum() == pytest.approx(1.0)
    assert set(times.at.tolist()) < set(times.between(4).tolist())
    even = KeyTimes.of(FrameOptions(easing=easing), 3)
    np.testing.assert_allclose(even.durations, 1 / 3)


@pytest.mark.parametrize("easing", ["linear", "ease-in-out"])
def test_every_key_is_met_at_its_time(keys: list[Floats], easing: Easing) -> None:
    parts = fits_of(keys)
    found = frames(parts, np.array([0.0, 0.2, 1.0]), FrameOptions(easing=easing, via_at=(0.2,)))
    np.testing.assert_array_equal(found, keys)


@pytest.mark.parametrize("at", [0.1, 0.5, 0.8])
def test_velocities_are_continuous_whatever_the_times(keys: list[Floats], at: float) -> None:
    parts, step = fits_of(keys), 1e-4
    around = frames(parts, at + step * np.arange(-2.0, 3.0), FrameOptions(via_at=(at,)))
    before = 3.0 * around[2] - 4.0 * around[1] + around[0]
    after = -3.0 * around[2] + 4.0 * around[3] - around[4]
    speed = max(np.abs(keys[1] - keys[0]).max() / at, np.abs(keys[2] - keys[1]).max() / (1.0 - at))
    assert np.abs(after - before).max() / (2.0 * step) < 0.02 * speed


def test_a_short_pair_does_not_throw_the_long_one_off_its_way() -> None:
    """With the mean of both velocities, the fast pair would carry the bar far beyond its next key."""
    keys = [BAR, bent(BAR, np.radians(60.0)), bent(BAR, np.radians(70.0))]
    found = frames(fits_of(keys), np.linspace(0.05, 1.0, 12), FrameOptions(via_at=(0.05,)))
    distances = np.abs(found - keys[2]).max(axis=(1, 2))
    assert distances.max() == distances[0]


def test_times_for_each_inner_key() -> None:
    with pytest.raises(InputError, match="1 times are given for 2 keys between the first and the last"):
        KeyTimes.of(FrameOptions(via_at=(0.5,)), 3)
    for wrong, sentence in (((0.5, 0.5), "too close"), ((0.6, 0.4), "wrong order"), ((0.0,), "between 0 and 1")):
        with pytest.raises(InputError, match=sentence):
            FrameOptions(via_at=wrong)
    with pytest.raises(InputError, match="number of in-betweens is -1"):
        KeyTimes.of(FrameOptions(), 2).between(-1)
