# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains: every key is met, inner keys without stop or jerk, lengths kept, still parts still."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.frames.report import Folds
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions, Mode
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.triangles.topology import sides, unique_edges

from ..baking import frames_of
from ..meshes import arced, bent, box_surface, twisted

BAR, FACES = box_surface((2, 2, 12), (1.0, 1.0, 5.0))
NORMAL = FitOptions()


def chain_of(keys: Sequence[Floats], options: FitOptions = NORMAL) -> list[FittedMap]:
    pairs = [KeyPair.checked(first, second, FACES) for first, second in pairwise(keys)]
    return [finish(fit_pair(pair, options)) for pair in pairs]


def baked(parts: list[FittedMap], times: Sequence[float] | Floats, mode: Mode = "natural") -> Bake:
    return frames_of(parts, times, mode)


def velocities(parts: list[FittedMap], time: float, step: float = 1e-3) -> tuple[Floats, Floats]:
    """Velocities just before and just after ``time``, by one-sided differences of second order."""
    far_before, before, here, after, far_after = baked(parts, time + step * np.arange(-2.0, 3.0)).frames
    return (
        (3.0 * here - 4.0 * before + far_before) / (2.0 * step),
        (-3.0 * here + 4.0 * after - far_after) / (2.0 * step),
    )


@pytest.fixture(scope="module")
def bending() -> list[FittedMap]:
    return chain_of([BAR, bent(BAR, np.radians(60.0)), bent(BAR, np.radians(150.0))])


@pytest.fixture(scope="module")
def turning_over() -> list[FittedMap]:
    """A bend that goes back through a twist: opposite directions before and after the inner key."""
    return chain_of([BAR, bent(BAR, np.radians(80.0)), twisted(BAR, np.radians(70.0))])


def test_every_key_is_met_bit_for_bit(bending: list[FittedMap]) -> None:
    bake = baked(bending, np.linspace(0.0, 1.0, 7))
    for index, key in ((0, bending[0].pair.key0), (3, bending[0].pair.key1), (6, bending[1].pair.key1)):
        np.testing.assert_array_equal(bake.frames[index], key)
    assert bake.report.key_error < 1e-9
    assert bake.report.folds == Folds(0, [0] * 7)


@pytest.mark.parametrize("chain", ["bending", "turning_over"])
def test_velocity_is_continuous_at_the_inner_key(chain: str, request: pytest.FixtureRequest) -> None:
    parts = request.getfixturevalue(chain)
    before, after = velocities(parts, 0.5)
    jump = np.linalg.norm(after - before, axis=1).max()
    alone = [frames_of(part, [0.0, 0.999, 0.001]).frames for part in parts]
    broken = np.linalg.norm((alone[0][1] - parts[0].pair.key1 + alone[1][2] - parts[1].pair.key0) / 1e-3, axis=1)
    # The pairs alone meet with a corner; velocities along the chain are per half of its time.
    assert jump < 0.02 * 2.0 * broken.max()


def test_a_chain_that_goes_on_does_not_stop(bending: list[FittedMap]) -> None:
    before, after = velocities(bending, 0.5)
    middle = 0.5 * np.linalg.norm(before + after, axis=1).max()
    traveled = [np.linalg.norm(part.pair.key1 - part.pair.key0, axis=1).max() for part in bending]
    assert middle > min(traveled)


@pytest.mark.parametrize(("chain", "part"), [("bending", 0.1), ("turning_over", 0.3)])
def test_lengths_hold_along_the_chain(chain: str, part: float, request: pytest.FixtureRequest) -> None:
    parts = request.getfixturevalue(chain)
    edges = unique_edges(sides(FACES))

    def lengths(shape: Floats) -> Floats:
        return np.asarray(np.linalg.norm(shape[edges[:, 0]] - shape[edges[:, 1]], axis=1))

    def excess(frames: Floats) -> float:
        low, high = (
            bound([lengths(key) for key in (parts[0].pair.key0, parts[0].pair.key1)], axis=0)
            for bound in (np.min, np.max)
        )
        worst = [np.maximum((low - lengths(shape)) / low, (lengths(shape) - high) / high) for shape in frames]
        return float(np.percentile(np.maximum(worst, 0.0), 99))

    times = np.array([0.2, 0.5, 0.8])
    straight = [(1.0 - time) * parts[0].pair.key0 + time * parts[0].pair.key1 for time in times]
    assert excess(baked(parts, 0.5 * times).frames) < part * excess(np.stack(straight))


def test_what_a_pair_leaves_in_place_stays_in_place() -> None:
    first = BAR.copy()
    parts = chain_of([first, arced(BAR, 1.0), bent(BAR, 1.0)])
    still = (parts[0].pair.key0 == parts[0].pair.key1).all(axis=1)
    assert 0.2 < still.mean() < 0.8
    for shape in baked(parts, [0.1, 0.25, 0.4]).frames:
        np.testing.assert_array_equal(shape[still], first[still])


def test_a_time_does_not_depend_on_its_neighbors(bending: list[FittedMap]) -> None:
    alone = baked(bending, [0.3]).frames[0]
    among = baked(bending, [0.1, 0.3, 0.9]).frames[1]
    np.testing.assert_array_equal(alone, among)


def test_linear_mode_bakes_the_pairs_as_published(bending: list[FittedMap]) -> None:
    bake = baked(bending, [0.25, 0.5, 0.75], "linear")
    alone = frames_of(bending[0], [0.5], "linear")
    np.testing.assert_array_equal(bake.frames[0], alone.frames[0])
    np.testing.assert_array_equal(bake.frames[1], bending[0].pair.key1)


def test_pairs_that_do_not_meet_are_refused(bending: list[FittedMap]) -> None:
    with pytest.raises(InputError, match="do not meet"):
        baked([bending[1], bending[0]], [0.5])
