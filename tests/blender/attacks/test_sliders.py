# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sliders of every type of custom property: unusable ones are named, and the user's own values stay."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender import compat, live_scrub
from qc3d_addon.blender.keys import chain_keys, drivers
from qc3d_addon.blender.keys.control import slider_path
from qc3d_addon.blender.store.records import Record

from ..test_panel_results import drawn

pytestmark = pytest.mark.usefixtures("quick_map")

Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]
SLIDER = "Basis_to_Lean"
NOT_A_NUMBER = f"The slider '{SLIDER}' of 'Figure' is no longer a number; delete that custom property, then re-bake"
DELETED = f"The slider '{SLIDER}' was deleted; re-bake it first."


@pytest.fixture
def baked(figure: bpy.types.Object) -> bpy.types.Object:
    choices = {"mode": "linear", "count": 1}
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", **choices) == {"FINISHED"}
    return figure


def put(obj: bpy.types.Object, value: object) -> None:
    """Give the slider a value of another type, as the panel of custom properties does."""
    del obj[SLIDER]
    obj[SLIDER] = obj if value == "an ID" else value
    obj.update_tag()
    bpy.context.view_layer.update()


def plain(value: object) -> object:
    for convert in ("to_dict", "to_list"):
        if hasattr(value, convert):
            return getattr(value, convert)()
    return value


OTHERS = ["a text", b"a\0b", [0.5], [1, 2], [True, False], [], {"a": 1}, {}, "an ID", ["a", "b"], "0.5", "nan"]


@pytest.mark.parametrize("value", OTHERS, ids=map(repr, OTHERS))
def test_what_is_no_number(baked: bpy.types.Object, state: State, tmp_path: Path, value: object) -> None:
    put(baked, value)
    before, there = state(), plain(baked[SLIDER])
    for name in ("rebake", "live_scrub", "select_worst", "to_keyframes", "absolute_keys", "heat_map"):
        with pytest.raises(RuntimeError) as caught:
            getattr(bpy.ops.qc3d, name)()
        assert str(caught.value).strip().startswith(f"Error: {NOT_A_NUMBER}"), name
        assert state() == before
    with pytest.raises(RuntimeError, match="is no longer a number"):
        bpy.ops.qc3d.bake_inbetweens(
            play_on="slider", from_key="Basis", to_key="Lean", mode="linear", use_keyframes=True
        )
    assert NOT_A_NUMBER in drawn(baked).texts[0]
    # What does not need it works, and leaves it alone.
    assert bpy.ops.qc3d.export_alembic(filepath=str(tmp_path / "a.abc"), frames=2) == {"FINISHED"}
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Stretch") == {"FINISHED"}
    assert bpy.ops.qc3d.remove(slider=SLIDER) == {"FINISHED"}
    assert plain(baked[SLIDER]) == there
    assert Record.read(baked.data.shape_keys).chain_of_slider(SLIDER) is None
    del baked[SLIDER]
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean") == {"FINISHED"}
    assert isinstance(baked[SLIDER], float)


@pytest.mark.parametrize("value", OTHERS, ids=map(repr, OTHERS))
def test_it_becomes_no_number_while_live_scrub_is_on(
    baked: bpy.types.Object, value: object, capfd: pytest.CaptureFixture[str]
) -> None:
    bpy.ops.qc3d.live_scrub()
    put(baked, value)
    assert not live_scrub.is_on(baked)
    assert live_scrub.KEY not in baked.data.shape_keys.key_blocks
    bpy.context.scene.frame_set(7)
    assert "Traceback" not in "".join(capfd.readouterr())


def test_a_deleted_one(baked: bpy.types.Object, state: State) -> None:
    del baked[SLIDER]
    before = state()
    for name in ("live_scrub", "select_worst", "to_keyframes", "absolute_keys", "heat_map"):
        with pytest.raises(RuntimeError, match=DELETED):
            getattr(bpy.ops.qc3d, name)()
        assert state() == before
    assert drawn(baked).texts[0] == DELETED
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    assert baked[SLIDER] == 0.0


@pytest.mark.parametrize("value", [True, False, 1, 0, -5, 2**31 - 1])
def test_whole_numbers_play_what_they_can(baked: bpy.types.Object, shown: Shown, value: int) -> None:
    ends = {place: shown(baked, **{SLIDER: place}) for place in (0.0, 1.0)}
    put(baked, value)
    kind = type(value)
    for operator in (bpy.ops.qc3d.rebake, bpy.ops.qc3d.live_scrub):
        assert operator() == {"FINISHED"}
        assert type(baked[SLIDER]) is kind
        assert baked[SLIDER] == value
    if value in (0, 1):
        np.testing.assert_allclose(shown(baked), ends[float(value)], atol=1e-6)
    # It cannot be put between the keys, where the worst place is.
    assert bpy.ops.qc3d.select_worst() == {"FINISHED"}
    assert type(baked[SLIDER]) is kind
    assert baked[SLIDER] == value
    assert bpy.ops.qc3d.heat_map() == {"FINISHED"}
    assert bpy.ops.qc3d.to_keyframes(frame_start=1, frame_end=3) == {"FINISHED"}
    assert SLIDER not in baked


@pytest.mark.parametrize("value", [math.inf, -math.inf, 1e308, -1e308, 1e-320, 2.0, -1.0])
def test_numbers_beyond_the_keys(baked: bpy.types.Object, shown: Shown, value: float) -> None:
    bpy.ops.qc3d.live_scrub()
    put(baked, value)
    assert live_scrub.is_on(baked)
    assert np.isfinite(shown(baked)).all()
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    assert baked[SLIDER] == value
    assert bpy.ops.qc3d.to_keyframes(frame_start=1, frame_end=3) == {"FINISHED"}
    assert np.isfinite(shown(baked)).all()


class TestNaN:
    """Blender stops a driver for good as soon as what it reads is NaN."""

    SENTENCE = f"The slider '{SLIDER}' of 'Figure' has no value (NaN); set one, or repair what drives it."

    def test_live_scrub_ends_and_can_be_switched_on_again(
        self, baked: bpy.types.Object, shown: Shown, capfd: pytest.CaptureFixture[str]
    ) -> None:
        put(baked, 0.4)
        bpy.ops.qc3d.live_scrub()
        there = shown(baked)
        put(baked, math.nan)
        assert not live_scrub.is_on(baked)
        assert live_scrub.KEY not in baked.data.shape_keys.key_blocks
        assert np.isfinite(shown(baked)).all()
        put(baked, 0.4)
        assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
        np.testing.assert_array_equal(shown(baked), there)
        assert "Traceback" not in "".join(capfd.readouterr())

    def test_nothing_works_on_it(self, baked: bpy.types.Object, state: State) -> None:
        put(baked, math.nan)
        before = repr(state())  # NaN is not equal to itself
        for name in ("rebake", "live_scrub", "select_worst", "to_keyframes", "absolute_keys", "heat_map"):
            with pytest.raises(RuntimeError) as caught:
                getattr(bpy.ops.qc3d, name)()
            assert str(caught.value).strip() == f"Error: {self.SENTENCE}", name
            assert repr(state()) == before
        assert drawn(baked).texts[0] == self.SENTENCE
        assert bpy.ops.qc3d.remove() == {"FINISHED"}
        assert SLIDER not in baked

    def test_the_panel_says_that_blender_stopped_it_and_re_bake_starts_it_again(
        self, baked: bpy.types.Object, shown: Shown
    ) -> None:
        there = shown(baked, **{SLIDER: 0.4})
        put(baked, math.nan)
        put(baked, 0.0)
        for curve in drivers.driven_by(baked.data.shape_keys, slider_path(SLIDER)).values():
            curve.driver.is_valid = False  # as Blender does for good to those of earlier versions
        assert "Blender stopped the drivers because the slider had no value (NaN) for a moment" in drawn(baked).texts[1]
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}
        assert not [text for text in drawn(baked).texts if "stopped" in text]
        np.testing.assert_array_equal(shown(baked, **{SLIDER: 0.4}), there)

    def test_at_one_frame(self, baked: bpy.types.Object, state: State) -> None:
        for frame in (1, 5, 6):
            baked.keyframe_insert(f'["{SLIDER}"]', frame=frame)
        curve = compat.find_fcurve(baked, f'["{SLIDER}"]')
        for point in curve.keyframe_points:
            point.interpolation = "CONSTANT"
        curve.keyframe_points[1].co.y = math.nan
        drivers = len(baked.data.shape_keys.animation_data.drivers)
        with pytest.raises(RuntimeError, match=r"has no value \(NaN\)"):
            bpy.ops.qc3d.to_keyframes(frame_start=2, frame_end=9)
        assert len(baked.data.shape_keys.animation_data.drivers) == drivers
        assert bpy.context.scene.frame_current == 1


def test_a_driver_that_reads_something_else_than_an_object(baked: bpy.types.Object) -> None:
    """As another add-on or a script may leave it: the slider is then that of the mesh's object."""
    (chain,) = Record.read(baked.data.shape_keys).chains
    for curve in drivers.driven_by(baked.data.shape_keys, slider_path(SLIDER)).values():
        target = curve.driver.variables[0].targets[0]
        target.id_type = "SCENE"
        target.id = bpy.context.scene
    assert chain_keys.control_of(baked, chain).owner == baked
    drawn(baked)
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    (owner,) = {
        curve.driver.variables[0].targets[0].id
        for curve in drivers.driven_by(baked.data.shape_keys, slider_path(SLIDER)).values()
    }
    assert owner == baked
