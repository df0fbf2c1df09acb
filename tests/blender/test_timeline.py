# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys at frames of their own: read from the timeline or given, and never shown twice."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from qc3d_addon.blender import compat
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.bake.run import bake_object
from qc3d_addon.blender.bake.timeline import keyed, keys_on_timeline
from qc3d_addon.blender.keys.control import slider_path, value_path
from qc3d_addon.blender.keys.double_motion import double_motion
from qc3d_addon.blender.store.chain import Chain
from qc3d_addon.blender.store.records import Record
from qc3d_addon.blender.ui.panels import QC3D_PT_inbetweens
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.settings import FrameOptions

from .conftest import Shapes, add_key
from .test_panel_results import Context, Layout

pytestmark = pytest.mark.usefixtures("quick_map")

Shown = Callable[..., np.ndarray]
ReadShapes = Callable[[bpy.types.Object], Shapes]
State = Callable[[], dict[str, object]]
LINEAR = FrameOptions("linear")
SLIDER = "Basis_to_Lean_to_Stretch"


def keyframe(obj: bpy.types.Object, name: str, values: dict[int, float]) -> None:
    key = obj.data.shape_keys.key_blocks[name]
    for frame, value in values.items():
        key.value = value
        key.keyframe_insert("value", frame=frame)


@pytest.fixture
def animated(figure: bpy.types.Object) -> bpy.types.Object:
    """Basis at frame 1, Lean at 12, Stretch at 24."""
    keyframe(figure, "Lean", {1: 0.0, 12: 1.0, 24: 0.0})
    keyframe(figure, "Stretch", {12: 0.0, 24: 1.0})
    bpy.context.scene.frame_set(1)
    return figure


def chain_of(obj: bpy.types.Object) -> Chain:
    return Record.read(obj.data.shape_keys).chains[-1]


def bake_from_the_panel(**choices: object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(mode="linear", count=2, **choices) == {"FINISHED"}


def is_muted(obj: bpy.types.Object, name: str) -> bool:
    curve = compat.find_fcurve(obj.data.shape_keys, value_path(name))
    assert curve is not None
    return bool(curve.mute)


class TestReading:
    def test_keys_one_after_another(self, animated: bpy.types.Object) -> None:
        assert keyed(animated) == ["Lean", "Stretch"]
        row = keys_on_timeline(animated, 1)
        assert (row.keys, row.frames, row.notes) == (("Basis", "Lean", "Stretch"), (1, 12, 24), ())

    def test_mixed_keyframes_are_left_out_and_named(self, animated: bpy.types.Object) -> None:
        keyframe(animated, "Stretch", {18: 0.3})
        row = keys_on_timeline(animated, 1)
        assert row.frames == (1, 12, 24)
        assert row.notes == ("Keyframes with several keys on, or one partly, are left out: 18.",)

    def test_a_held_key_ends_a_row(self, animated: bpy.types.Object) -> None:
        keyframe(animated, "Lean", {14: 1.0, 30: 0.0})
        keyframe(animated, "Stretch", {14: 0.0, 30: 0.0})
        first, second = keys_on_timeline(animated, 5), keys_on_timeline(animated, 20)
        assert (first.keys, first.frames) == (("Basis", "Lean"), (1, 12))
        assert (second.keys, second.frames) == (("Lean", "Stretch", "Basis"), (14, 24, 30))
        assert first.notes[0].startswith("These are the keys from frame 1 to 12; one is held there.")

    def test_without_such_keyframes_it_says_what_is_needed(self, figure: bpy.types.Object) -> None:
        assert keyed(figure) == []
        with pytest.raises(InputError, match="No two shape keys of 'Figure' follow one another"):
            keys_on_timeline(figure, 1)
        keyframe(figure, "Lean", {3: 0.5})
        with pytest.raises(RuntimeError, match="one key is at 1 and the others are at 0"):
            bpy.ops.qc3d.keys_from_timeline()

    def test_keyframes_of_made_keys_are_not_the_users(self, animated: bpy.types.Object) -> None:
        bake_from_the_panel(from_key="Basis", to_key="Lean")
        keyframe(animated, "Lean_33", {5: 1.0})
        assert keyed(animated) == ["Lean", "Stretch"]


class TestBaking:
    def test_each_key_is_shown_at_its_frame_and_only_once(
        self, animated: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        assert bpy.ops.qc3d.keys_from_timeline() == {"FINISHED"}
        bake_from_the_panel()
        chain = chain_of(animated)
        assert (chain.on_key, chain.slider, chain.keyframes) == ("", SLIDER, (1, 12, 24))
        assert chain.via_at == pytest.approx((11 / 23,))
        curve = compat.find_fcurve(animated, slider_path(SLIDER))
        assert curve is not None
        np.testing.assert_allclose(
            [point.co for point in curve.keyframe_points], [(1, 0), (12, 11 / 23), (24, 1)], atol=1e-6
        )
        got = shapes(animated)
        for frame, name in ((1, "Basis"), (12, "Lean"), (24, "Stretch")):
            bpy.context.scene.frame_set(frame)
            assert np.abs(shown(animated) - got[name]).max() < 1e-5, name
        assert double_motion(animated, chain, [chain]) == []

    def test_keyframes_are_muted_and_come_back(self, animated: bpy.types.Object, state: State, shown: Shown) -> None:
        before, at_12 = state(), {}
        bpy.context.scene.frame_set(12)
        at_12["before"] = shown(animated)
        result = bake_object(
            animated, BakeRequest(("Basis", "Lean", "Stretch"), 2, frame_options=LINEAR, keyframes=(1, 12, 24))
        )
        assert any(
            note.startswith("The keyframes of 'Lean' and 'Stretch' are muted, since they would add")
            for note in result.notes
        )
        assert is_muted(animated, "Lean")
        assert is_muted(animated, "Stretch")
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}  # leaves both as they are
        assert is_muted(animated, "Lean")
        assert chain_of(animated).muted == ("Lean", "Stretch")
        assert bpy.ops.qc3d.remove() == {"FINISHED"}
        for frame in (1, 12):
            bpy.context.scene.frame_set(frame)
        np.testing.assert_array_equal(shown(animated), at_12["before"])
        bpy.context.scene.frame_set(1)
        assert state() == before

    def test_a_driven_last_key_gets_a_slider_beside_it(self, figure: bpy.types.Object) -> None:
        curve = figure.data.shape_keys.driver_add(value_path("Stretch"))
        keys = ("Basis", "Lean", "Stretch")
        result = bake_object(figure, BakeRequest(keys, 1, frame_options=LINEAR, keyframes=(1, 12, 24)))
        assert result.slider == SLIDER
        assert curve.driver is not None
        assert any("Key 'Stretch' is driven, which adds to what the slider shows" in note for note in result.notes)

    def test_a_key_without_its_own_keyframes_plays_them_itself(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        bake_from_the_panel(
            from_key="Basis",
            via=[{"name": "Lean"}],
            via_frames="12",
            to_key="Stretch",
            frame_start=1,
            frame_end=24,
        )
        assert chain_of(figure).on_key == "Stretch"
        bpy.context.scene.frame_set(12)
        assert figure.data.shape_keys.key_blocks["Stretch"].value == pytest.approx(11 / 23)
        assert np.abs(shown(figure) - shapes(figure)["Lean"]).max() < 1e-5

    def test_an_action_that_others_use_is_left_alone(self, animated: bpy.types.Object) -> None:
        action = animated.data.shape_keys.animation_data.action
        other = bpy.data.objects.new("Other", None)
        other.animation_data_create().action = action
        keys = ("Basis", "Lean", "Stretch")
        result = bake_object(animated, BakeRequest(keys, 1, frame_options=LINEAR, keyframes=(1, 12, 24)))
        assert not is_muted(animated, "Lean")
        assert sum("is animated, which adds to what the slider shows" in note for note in result.notes) == 2

    def test_a_failed_bake_mutes_nothing(
        self, animated: bpy.types.Object, state: State, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from qc3d_addon.blender.bake import bookkeeping

        before = state()

        def fail(*_: object) -> None:
            raise InputError("no")

        monkeypatch.setattr(bookkeeping, "remember", fail)
        with pytest.raises(InputError, match="no"):
            bake_object(
                animated, BakeRequest(("Basis", "Lean", "Stretch"), 1, frame_options=LINEAR, keyframes=(1, 12, 24))
            )
        bpy.context.scene.frame_set(1)
        assert state() == before

    def test_other_frames_move_the_keys_and_edited_timing_stays(self, figure: bpy.types.Object) -> None:
        keys = {"from_key": "Basis", "via": [{"name": "Lean"}], "to_key": "Stretch", "play_on": "slider"}
        bake_from_the_panel(**keys, via_frames="12", frame_start=1, frame_end=24)
        bake_from_the_panel(**keys, via_frames="6", frame_start=1, frame_end=21)
        curve = compat.find_fcurve(figure, slider_path(SLIDER))
        assert curve is not None
        np.testing.assert_allclose([point.co for point in curve.keyframe_points], [(1, 0), (6, 0.25), (21, 1)])
        assert chain_of(figure).places[3] == pytest.approx(0.25)
        curve.keyframe_points[1].co.x = 8.0
        bake_from_the_panel(**keys, via_frames="6", frame_start=1, frame_end=31)
        assert [point.co.x for point in curve.keyframe_points] == [1.0, 8.0, 21.0]
        assert "were edited and were left as they are" in " ".join(chain_of(figure).result.notes)

    def test_a_renamed_muted_key_is_found_again(self, animated: bpy.types.Object) -> None:
        bpy.ops.qc3d.keys_from_timeline()
        bake_from_the_panel()
        animated.data.shape_keys.key_blocks["Lean"].name = "Bow"
        assert chain_of(animated).muted == ("Bow", "Stretch")
        assert bpy.ops.qc3d.remove() == {"FINISHED"}
        assert not is_muted(animated, "Bow")


class TestValues:
    @pytest.mark.parametrize("play_on", ["key", "slider"])
    def test_sculpted_keys_are_met_at_the_values_in_their_names(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown, play_on: str
    ) -> None:
        for name, part in (("Lean_60", 0.9), ("Lean_25", 0.1)):
            add_key(figure, name, lambda rest, part=part: rest + np.maximum(rest[:, 2:], 0.0) * [part, 0.0, -part])
        figure.active_shape_key_index = figure.data.shape_keys.key_blocks.find("Lean")
        assert bpy.ops.qc3d.go_through_sculpted() == {"FINISHED"}
        assert figure.qc3d.via_timing == "value"
        bake_from_the_panel(play_on=play_on)
        chain, got = chain_of(figure), shapes(figure)
        assert chain.via_at == (0.25, 0.6)
        assert {0.25, 0.6} < set(chain.places)
        key = figure.data.shape_keys.key_blocks["Lean"]
        for value, name in ((0.25, "Lean_25"), (0.6, "Lean_60"), (1.0, "Lean")):
            if play_on == "key":
                key.value = value
                found = shown(figure)
            else:
                found = shown(figure, **{chain.slider: value})
            assert np.abs(found - got[name]).max() < 1e-5, name
        places = chain.places
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}
        assert chain_of(figure).places == places
        if play_on == "key":
            only = {"which": "named", "keys": [{"name": "Lean"}]}
            assert bpy.ops.qc3d.bake_keys(**only, mode="linear", count=2) == {"FINISHED"}
            assert chain_of(figure).places == places

    def test_live_scrub_shows_them_there_too(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        keys = {"from_key": "Basis", "via": [{"name": "Lean"}], "to_key": "Stretch", "play_on": "slider"}
        bake_from_the_panel(**keys, via_at="0.2", easing="ease-in")
        assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
        assert np.abs(shown(figure, **{SLIDER: 0.2}) - shapes(figure)["Lean"]).max() < 1e-5
        assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}

    @pytest.mark.parametrize(
        ("choices", "sentence"),
        [
            ({"via_at": "0.2 0.4"}, "2 times are given for 1 keys"),
            ({"via_at": "1.2"}, "time of a key is 1.2"),
            ({"via_at": "half"}, "'half' is not a row of numbers"),
            ({"via_frames": "12 13", "frame_end": 20}, "4 frames are given for 3 keys"),
            ({"via_frames": "30", "frame_end": 20}, "from 30 to 20 are not possible"),
            ({"via_at": "0.0001"}, "too close or in the wrong order"),
        ],
    )
    def test_values_that_cannot_be(self, figure: bpy.types.Object, choices: dict[str, object], sentence: str) -> None:
        with pytest.raises(RuntimeError, match=sentence):
            bake_from_the_panel(from_key="Basis", via=[{"name": "Lean"}], to_key="Stretch", **choices)
        assert len(figure.data.shape_keys.key_blocks) == 3


class TestRows:
    def test_new_rows_come_after_the_last(self, figure: bpy.types.Object) -> None:
        figure.qc3d.frame_start, figure.qc3d.frame_end = 1, 25
        for _ in range(3):
            assert bpy.ops.qc3d.add_inner_key() == {"FINISHED"}
        assert [row.at for row in figure.qc3d.via] == pytest.approx([0.5, 0.75, 0.875])
        assert [row.frame for row in figure.qc3d.via] == [13, 19, 22]

    def test_who_names_the_keys_gets_no_times_of_the_panel(self, animated: bpy.types.Object) -> None:
        assert bpy.ops.qc3d.keys_from_timeline() == {"FINISHED"}
        bake_from_the_panel(from_key="Basis", via=[{"name": "Stretch"}], to_key="Lean", use_keyframes=False)
        assert chain_of(animated).via_at == ()
        assert chain_of(animated).keyframes is None


def test_the_panel_shows_what_counts(animated: bpy.types.Object) -> None:
    layout = panel(animated)
    assert "keys_from_timeline" in [name for name, _ in layout.buttons]
    assert not {"via_timing", "at", "frame"} & set(layout.texts)
    assert bpy.ops.qc3d.keys_from_timeline() == {"FINISHED"}
    texts = panel(animated).texts
    assert {"via_timing", "frame", "frame_start", "frame_end"} <= set(texts)
    assert not {"at", "use_keyframes"} & set(texts)  # frames are keyframes
    animated.qc3d.via_timing = "value"
    assert {"at", "use_keyframes"} <= set(panel(animated).texts)
    bake_from_the_panel()
    assert chain_of(animated).result.count == 4


def panel(obj: bpy.types.Object) -> Layout:
    class Panel:
        layout = Layout()

    QC3D_PT_inbetweens.draw(Panel(), Context(obj))  # type: ignore[arg-type]
    return Panel.layout
