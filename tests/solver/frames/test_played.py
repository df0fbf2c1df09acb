# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a control plays: the moments that it needs, and how close that comes to the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.frames.easing import eased, uneased
from qc3d_addon.solver.frames.played import DENSE_STEPS, Moments
from qc3d_addon.solver.frames.report import BakeReport
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.frames.weights import Weights
from qc3d_addon.solver.settings import Easing, FrameOptions, Mode, PlayOptions, WeightKind
from qc3d_addon.solver.support.progress import finish

from ..meshes import arced, box_surface, twisted

pytestmark = pytest.mark.usefixtures("coarse_volume")
BAR, FACES = box_surface((2, 2, 12), (1.0, 1.0, 5.0))
ARCED = arced(BAR, 1.2)


def bake(play: PlayOptions, through: str = "ab", mode: Mode = "natural", easing: Easing = "linear") -> Bake:
    shapes = {"a": BAR, "b": ARCED, "c": arced(BAR, -0.4)}
    task = Task.of_keys(shapes, FACES, None, tuple(through), frame_options=FrameOptions(mode, easing))
    task = Task(task.pairs, task.through, task.fit_options, task.frame_options, play=play)
    found = finish(carry_out(task)).bake
    assert found is not None
    return found


@pytest.mark.parametrize("easing", ["linear", "ease-in", "ease-out", "ease-in-out"])
def test_easing_there_and_back(easing: Easing) -> None:
    parts = np.linspace(0.0, 1.0, 33)
    np.testing.assert_allclose(eased(uneased(parts, easing), easing), parts, atol=1e-12)
    assert uneased(np.array([0.0, 1.0]), easing).tolist() == [0.0, 1.0]


class TestMoments:
    def test_a_number_of_in_betweens_and_what_lies_between_them(self) -> None:
        moments = Moments.of(PlayOptions(count=3), FrameOptions(), 1)
        np.testing.assert_allclose(moments.times, np.linspace(0.0, 1.0, 9))
        assert moments.shapes.tolist() == [0, 2, 4, 6, 8]
        assert moments.keys.tolist() == [0, 8]

    @pytest.mark.parametrize("easing", ["ease-in", "ease-out", "ease-in-out"])
    def test_keys_are_met_whatever_the_easing(self, easing: Easing) -> None:
        moments = Moments.of(PlayOptions(count=2), FrameOptions(easing=easing), 3)
        np.testing.assert_allclose(eased(moments.times[moments.keys], easing), [0, 1 / 3, 2 / 3, 1], atol=1e-12)
        assert len(moments.shapes) == 10

    def test_places_of_ones_own_stand_beside_the_others(self) -> None:
        moments = Moments.of(PlayOptions(count=1, also_at=(0.5, 0.8)), FrameOptions(), 1)
        np.testing.assert_allclose(moments.times[moments.shapes], [0.0, 0.5, 0.8, 1.0])

    def test_a_tolerance_looks_at_many(self) -> None:
        assert len(Moments.of(PlayOptions(tolerance=0.1), FrameOptions(), 2).times) == 2 * DENSE_STEPS + 1


@pytest.mark.parametrize("mode", ["natural", "linear", "straight"])
def test_what_is_played_is_told(mode: Mode) -> None:
    found = bake(PlayOptions(count=3), mode=mode)
    report = found.report.played
    assert report is not None
    np.testing.assert_allclose(found.times, np.linspace(0.0, 1.0, 5))
    assert len(found.report.crossings) == len(found.frames) == 5
    assert report.positions == 12
    assert (report.folds is None) == (mode == "straight")
    assert BakeReport.from_json(found.report.as_json()) == found.report
    if mode == "natural":
        assert 0.0 < report.distance < 1e-3
        assert report.folds == 0
        assert report.volume is not None
        assert report.volume < 0.01
    if mode == "straight":
        assert report.distance < 1e-15
        assert report.worst_stretch == pytest.approx(found.report.worst_stretch.excess, rel=0.2)


def test_smooth_weights_play_many_times_nearer_than_hats() -> None:
    reports = [bake(PlayOptions(count=3, weights=kind)).report.played for kind in ("smooth", "hats")]
    assert reports[0].distance < 0.1 * reports[1].distance
    assert reports[0].worst_stretch < 0.5 * reports[1].worst_stretch


def largest_distance(found: Bake, kind: WeightKind = "smooth") -> float:
    """Of the played path from a bake of the same motion in many places."""
    places = np.linspace(0.0, 1.0, 60)[1:-1]
    dense = bake(PlayOptions(count=1, also_at=tuple(places.tolist())))
    weights: Weights = getattr(Weights, kind)(found.times)
    played: Floats = weights.played(found.frames, dense.times)
    return float(np.linalg.norm(played - dense.frames, axis=2).max())


@pytest.mark.slow
def test_as_few_as_needed() -> None:
    found = bake(PlayOptions(tolerance=0.01))
    assert largest_distance(found) <= 0.011
    assert len(found.times) <= 6
    assert len(bake(PlayOptions(tolerance=1e-4)).times) > len(found.times)


def test_a_tolerance_that_cannot_be_met_is_said() -> None:
    found = bake(PlayOptions(tolerance=1e-12, weights="hats"))
    assert len(found.times) == DENSE_STEPS + 1
    assert not any("miss it" in note for note in found.report.notes)  # at every frame that was computed it is met


def test_a_chain_goes_through_its_keys_smoothly() -> None:
    found = bake(PlayOptions(count=2), through="bac")
    np.testing.assert_array_equal(found.frames[[0, 3, 6]], [ARCED, BAR, arced(BAR, -0.4)])
    assert found.report.played is not None
    assert found.report.played.folds == 0
    assert found.report.played.distance < 5e-3


def test_a_chain_in_mode_straight_turns_its_corner() -> None:
    found = bake(PlayOptions(count=1), through="bac", mode="straight")
    assert found.report.played is not None
    assert found.report.played.distance < 1e-15


class TestMore:
    """A bar that twists loses its volume between a few in-betweens."""

    TWISTED = twisted(BAR, np.radians(270.0))

    def found(self, play: PlayOptions, through: str = "ab") -> Bake:
        shapes = {"a": BAR, "b": self.TWISTED, "c": arced(BAR, 0.1)}
        task = Task.of_keys(shapes, FACES, None, tuple(through))
        found = finish(carry_out(replace(task, play=play))).bake
        assert found is not None
        return found

    @pytest.mark.parametrize("weights", ["smooth", "hats"])
    def test_more_in_betweens_where_volumes_ask_for_them(self, weights: WeightKind) -> None:
        few = self.found(PlayOptions(count=3, weights=weights))
        more = self.found(PlayOptions(count=3, weights=weights, more=True))
        assert few.report.played is not None
        assert more.report.played is not None
        assert few.report.played.volume > 0.004
        assert more.report.played.volume < 0.5 * few.report.played.volume
        assert len(few.times) == 5 < len(more.times) <= 9
        np.testing.assert_array_equal(more.frames[-1], self.TWISTED)

    def test_no_more_than_needed(self) -> None:
        play = PlayOptions(count=5, more=True)
        np.testing.assert_allclose(bake(play).times, np.linspace(0.0, 1.0, 7))

    def test_only_between_the_keys_that_need_them_and_beside_places_of_ones_own(self) -> None:
        found = self.found(PlayOptions(count=3, more=True, also_at=(0.9,)), through="bac")
        before, after = found.times[found.times < 0.5], found.times[found.times > 0.5]
        assert len(before) > 4
        np.testing.assert_allclose(after, [0.625, 0.75, 0.875, 0.9, 1.0])

    def test_one_more_stands_half_way_between_the_others(self) -> None:
        moments = Moments.of(PlayOptions(count=2), FrameOptions(), 1)
        assert moments.denser(PlayOptions(count=2), [0]).tolist() == [0, 2, 4, 6]
        assert moments.denser(PlayOptions(count=2), [1]).tolist() == [0, 1, 3, 5, 6]
        assert moments.denser(PlayOptions(count=2), [2]).tolist() == [0, 1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        ({"count": -1}, "number of in-betweens is -1"),
        ({"count": 2.0}, "number of in-betweens is 2.0"),
        ({"tolerance": -0.1}, "tolerance is -0.1"),
        ({"tolerance": float("nan")}, "tolerance is nan"),
        ({"weights": "cubic"}, "Unknown weights 'cubic'"),
        ({"also_at": (0.5, 1.0)}, "between 0 and 1"),
        ({"also_at": ("a",)}, "place of an in-between is 'a'"),
        ({"more": 1}, "option more is 1"),
    ],
)
def test_options_are_checked(choice: dict[str, object], sentence: str) -> None:
    from qc3d_addon.solver.errors import InputError

    with pytest.raises(InputError, match=sentence):
        PlayOptions(**choice)
