# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user did to what a bake made is still there after the next one, and nothing is left broken by any."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender import compat
from qc3d_addon.blender.bake.plan import plan_bake, write_bake
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.bake.suggested_keys import made_keys, sculpted_between
from qc3d_addon.blender.keys.leftovers import leftovers
from qc3d_addon.blender.store.chain import Chain
from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.task import carry_out
from qc3d_addon.solver.support.progress import finish

from .test_panel_results import drawn

pytestmark = pytest.mark.usefixtures("quick_map")

ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]
Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]
BUMP = np.float32([0.0, 0.25, 0.5])


def bake(**choices: object) -> None:
    pair = {"from_key": "Basis", "to_key": "Lean", "mode": "linear", "easing": "ease-in-out", "count": 3}
    assert bpy.ops.qc3d.bake_inbetweens(**{**pair, **choices}) == {"FINISHED"}


def newest(obj: bpy.types.Object) -> Chain:
    return Record.read(obj.data.shape_keys).chains[-1]


def sculpt(obj: bpy.types.Object, name: str, index: int = 3) -> None:
    point = obj.data.shape_keys.key_blocks[name].points[index]
    point.co = np.array(point.co) + BUMP


def notes(obj: bpy.types.Object) -> str:
    return " ".join(newest(obj).result.notes)


@pytest.mark.parametrize(("play_on", "name"), [("key", "Lean_50"), ("slider", "Basis_to_Lean_50")])
class TestSculpted:
    def test_it_stays_on_top_of_a_new_bake(
        self, figure: bpy.types.Object, shapes: ReadShapes, play_on: str, name: str
    ) -> None:
        bake(play_on=play_on)
        first = shapes(figure)[name]
        sculpt(figure, name)
        sculpt(figure, "Lean", 7)
        for _ in range(2):
            assert bpy.ops.qc3d.rebake() == {"FINISHED"}
            assert f"'{name}' keeps what was sculpted into it" in notes(figure)
        with_both = shapes(figure)[name]
        figure.data.shape_keys.key_blocks[name].points.foreach_set("co", (with_both - _bump(3, with_both)).ravel())
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}
        without = shapes(figure)[name]
        np.testing.assert_allclose(with_both - without, _bump(3, without), atol=1e-6)
        assert np.abs(without - first)[3].max() < 1e-6

    def test_it_stays_where_the_number_of_in_betweens_changes(
        self, figure: bpy.types.Object, shapes: ReadShapes, play_on: str, name: str
    ) -> None:
        bake(play_on=play_on)
        before = shapes(figure)[name]
        sculpt(figure, name)
        bake(play_on=play_on, count=2)
        assert newest(figure).places == pytest.approx((0.0, 1 / 3, 0.5, 2 / 3, 1.0))
        np.testing.assert_allclose(shapes(figure)[name] - before, _bump(3, before), atol=1e-6)

    def test_deleted_it_is_made_anew(
        self, figure: bpy.types.Object, shapes: ReadShapes, play_on: str, name: str
    ) -> None:
        bake(play_on=play_on)
        before = shapes(figure)[name]
        sculpt(figure, name)
        figure.active_shape_key_index = figure.data.shape_keys.key_blocks.find(name)
        bpy.ops.object.shape_key_remove()
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}
        np.testing.assert_array_equal(shapes(figure)[name], before)

    def test_a_basis_edited_together_with_its_keys_is_no_sculpting(
        self, figure: bpy.types.Object, shapes: ReadShapes, play_on: str, name: str
    ) -> None:
        bake(play_on=play_on)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.object.mode_set(mode="OBJECT")
        for key in figure.data.shape_keys.key_blocks:  # as Edit Mode does
            key.points[3].co = np.array(key.points[3].co) + BUMP
        before = shapes(figure)[name]
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}
        assert "sculpted" not in notes(figure)
        assert np.abs(shapes(figure)[name] - before)[3].max() < 1e-5

    def test_a_locked_one_is_left_and_the_rest_is_baked(
        self, figure: bpy.types.Object, shapes: ReadShapes, play_on: str, name: str
    ) -> None:
        bake(play_on=play_on, easing="ease-in")
        figure.data.shape_keys.key_blocks[name].lock_shape = True
        sculpt(figure, "Lean", 7)
        before = shapes(figure)
        bake(play_on=play_on, easing="ease-in", count=5)
        after = shapes(figure)
        np.testing.assert_array_equal(after[name], before[name])
        assert f"'{name}' is locked and was left as it is." in notes(figure)
        other = name.replace("_50", "_67")
        assert np.abs(after[other][7] - after[name][7]).max() > 0.0
        figure.data.shape_keys.key_blocks[name].lock_shape = False
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}
        assert np.abs(shapes(figure)[name] - before[name])[7].max() > 0.01  # it was not sculpted
        assert "keeps" not in notes(figure)

    def test_sculpted_while_a_bake_works(
        self, figure: bpy.types.Object, state: State, play_on: str, name: str
    ) -> None:
        bake(play_on=play_on)
        plan = plan_bake(figure, BakeRequest(("Basis", "Lean"), 2, play_on=play_on, frame_options=_linear()))
        outcome = finish(carry_out(plan.task))
        sculpt(figure, name)
        before = state()
        with pytest.raises(InputError, match=f"'{name}' was sculpted or locked during the bake; bake again to keep it"):
            write_bake(plan, outcome)
        assert state() == before


def _linear() -> Any:  # noqa: ANN401
    from qc3d_addon.solver.settings import FrameOptions

    return FrameOptions("linear", "ease-in-out")


def _bump(index: int, shape: np.ndarray) -> np.ndarray:
    moved = np.zeros_like(shape)
    moved[index] = BUMP
    return moved


def test_keyframes_that_were_added_or_moved_stay(figure: bpy.types.Object) -> None:
    bake(use_keyframes=True, frame_start=1, frame_end=11)
    keys = figure.data.shape_keys
    curve = compat.find_fcurve(keys, 'key_blocks["Lean"].value')
    curve.keyframe_points.insert(5, 0.9)
    bake(use_keyframes=True, frame_start=5, frame_end=50)
    assert [point.co.x for point in curve.keyframe_points] == [1.0, 5.0, 11.0]
    assert "The keyframes of the key 'Lean' were edited and were left as they are." in notes(figure)


def test_two_modes_stand_beside_each_other(figure: bpy.types.Object, shapes: ReadShapes) -> None:
    bake(play_on="slider")
    first = shapes(figure)
    bake(play_on="slider", mode="straight", easing="linear")
    after = shapes(figure)
    assert all(np.array_equal(after[name], shape) for name, shape in first.items())
    assert {"Basis_to_Lean", "Basis_to_Lean_straight"} <= set(figure.keys())
    bake(play_on="slider", mode="straight", easing="linear")
    assert list(shapes(figure)) == list(after)
    for slider in ("Basis_to_Lean", "Basis_to_Lean_straight"):
        assert bpy.ops.qc3d.rebake(slider=slider) == {"FINISHED"}
    assert list(shapes(figure)) == list(after)


def test_a_renamed_key_is_followed_by_a_slider_too(figure: bpy.types.Object) -> None:
    bake(from_key="Lean", to_key="Stretch")
    keys = figure.data.shape_keys.key_blocks
    keys["Lean"].name, keys["Stretch"].name = "Bow", "Reach"
    assert newest(figure).through == ("Bow", "Reach")
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}


def test_a_made_key_that_a_driver_reads_stays_when_the_rest_is_removed(figure: bpy.types.Object) -> None:
    bake()
    keys = figure.data.shape_keys
    curve = keys.driver_add('key_blocks["Stretch"].value')
    curve.driver.type = 'AVERAGE'
    variable = curve.driver.variables.new()
    target = variable.targets[0]
    target.id_type, target.id, target.data_path = 'KEY', keys, 'key_blocks["Lean_25"].value'
    keys.driver_add('key_blocks["Lean_50"].slider_max')  # of the user's own on a made key
    assert bpy.ops.qc3d.remove() == {"FINISHED"}
    assert keys.key_blocks.keys() == ["Basis", "Lean", "Stretch", "Lean_25"]
    assert [other.data_path for other in keys.animation_data.drivers] == ['key_blocks["Stretch"].value']
    bpy.context.view_layer.update()
    assert curve.driver.is_valid
    assert keys.key_blocks["Lean_25"].value == 0.0


def test_a_copy_made_by_a_script_plays_by_its_own_slider_after_a_re_bake(
    figure: bpy.types.Object, shown: Shown
) -> None:
    bake(play_on="slider")
    copy = figure.copy()
    copy.data = figure.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    bpy.context.view_layer.objects.active = copy
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    rest = shown(copy, Basis_to_Lean=0.0)
    shown(figure, Basis_to_Lean=0.7)
    np.testing.assert_array_equal(shown(copy), rest)
    assert np.abs(shown(copy, Basis_to_Lean=0.7) - rest).max() > 0.1


def test_a_made_key_that_a_driver_reads_stays_when_a_new_bake_has_none_at_its_place(figure: bpy.types.Object) -> None:
    bake()
    keys = figure.data.shape_keys
    curve = keys.driver_add('key_blocks["Stretch"].value')
    variable = curve.driver.variables.new()
    target = variable.targets[0]
    target.id_type, target.id, target.data_path = 'KEY', keys, 'key_blocks["Lean_25"].value'
    keys.key_blocks["Lean_75"].keyframe_insert("value", frame=3)
    bake(count=2)
    said = notes(figure)
    assert "Key 'Lean_25' stays, with value 0, since 1 driver reads it." in said
    assert "The keyframes of 'Lean_75', which is gone, stay in the action without effect." in said
    assert set(newest(figure).keys.values()) == {"Lean_33", "Lean_67"}
    assert "Lean_75" not in keys.key_blocks
    stays = keys.key_blocks["Lean_25"]
    assert (stays.value, stays.slider_min, stays.slider_max) == (0.0, 0.0, 1.0)
    bpy.context.view_layer.update()
    assert curve.driver.is_valid


class TestJoined:
    """Blender joins shape keys, but keeps drivers and custom properties of the active object only."""

    def join(self, figure: bpy.types.Object, other_key: str) -> None:
        other = figure.copy()
        other.data = figure.data.copy()
        bpy.context.scene.collection.objects.link(other)
        bake()
        bpy.context.view_layer.objects.active = other
        bake(to_key=other_key)
        bpy.context.view_layer.objects.active = figure
        for obj in (figure, other):
            obj.select_set(True)
        bpy.ops.object.join()

    def test_keys_without_record_and_drivers_are_said(self, figure: bpy.types.Object) -> None:
        self.join(figure, "Stretch")
        keys = figure.data.shape_keys
        assert leftovers(keys, made_keys(keys)) == ["Stretch_25", "Stretch_50", "Stretch_75"]
        assert sculpted_between(figure, "Stretch") == {}
        assert bpy.ops.qc3d.rebake() == {"FINISHED"}
        assert "'Stretch_25' and 2 more look like in-betweens, but nothing plays them" in notes(figure)
        assert "The mesh has 84 vertices, and had 42 at the earlier bake, so what was sculpted" in notes(figure)
        for name in ("Stretch_25", "Stretch_50", "Stretch_75"):
            figure.shape_key_remove(keys.key_blocks[name])
        bake(to_key="Stretch")
        assert newest(figure).keys == {1: "Stretch_25", 2: "Stretch_50", 3: "Stretch_75"}
        assert "look like in-betweens" not in notes(figure)

    def test_bakes_of_keys_of_one_name_play_on_together(
        self, figure: bpy.types.Object, shown: Shown, shapes: ReadShapes
    ) -> None:
        self.join(figure, "Lean")
        keys = figure.data.shape_keys
        assert leftovers(keys, made_keys(keys)) == []
        got = shapes(figure)
        keys.key_blocks["Lean"].value = 0.5
        middle = 0.5 * (got["Basis"] + got["Lean"]) + got["Lean_50"] - got["Basis"]
        assert np.abs(shown(figure) - middle).max() < 1e-5
        bake()
        assert newest(figure).keys == {1: "Lean_25", 2: "Lean_50", 3: "Lean_75"}


def test_a_copy_that_follows_the_original_is_said(figure: bpy.types.Object) -> None:
    bake(play_on="slider")
    copy = figure.copy()
    copy.data = figure.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    sentence = "The slider of 'Figure' still plays these in-betweens; re-bake to have their own."
    assert sentence in drawn(copy).texts
    assert sentence not in drawn(figure).texts
    bpy.context.view_layer.objects.active = copy
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    assert sentence not in drawn(copy).texts
