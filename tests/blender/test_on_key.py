# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens on the key itself: whatever controls the key plays the arc, and the key is as it was."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from qc3d_addon.blender.keys import chain_shapes
from qc3d_addon.blender.store.chain import Chain
from qc3d_addon.blender.store.records import Record

pytestmark = pytest.mark.usefixtures("quick_map")

Shapes = dict[str, np.ndarray]
ReadShapes = Callable[[bpy.types.Object], Shapes]
Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]


def bake(**choices: object) -> None:
    # A changing speed: the way is straight, and yet not what the straight blend shows.
    pair = {"from_key": "Basis", "to_key": "Lean", "mode": "linear", "easing": "ease-in-out"}
    assert bpy.ops.qc3d.bake_inbetweens(**{**pair, **choices}) == {"FINISHED"}


def chain_of(obj: bpy.types.Object) -> Chain:
    return Record.read(obj.data.shape_keys).chains[-1]


def at(obj: bpy.types.Object, shown: Shown, value: float, name: str = "Lean") -> np.ndarray:
    obj.data.shape_keys.key_blocks[name].value = value
    obj.data.shape_keys.update_tag()
    return shown(obj)


def path(obj: bpy.types.Object) -> CubicSpline:
    chain = chain_of(obj)
    return CubicSpline(chain.places, chain_shapes.step_shapes(obj, chain))


def test_its_own_value_plays_the_path_and_the_key_is_as_it_was(
    figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
) -> None:
    before, straight = shapes(figure), at(figure, shown, 0.25)
    ends = [at(figure, shown, value) for value in (0.0, 1.0)]
    bake(count=3)
    after = shapes(figure)
    assert list(after) == [*before, "Lean_25", "Lean_50", "Lean_75"]
    assert all(np.array_equal(after[name], shape) for name, shape in before.items())
    assert "Lean" not in figure  # no slider
    assert figure.data.shape_keys.key_blocks["Lean"].value == 1.0
    for value, end in zip((0.0, 1.0), ends, strict=True):
        np.testing.assert_array_equal(at(figure, shown, value), end)
    assert np.abs(at(figure, shown, 0.25) - straight).max() > 0.01
    spline = path(figure)
    for value in (0.1, 0.25, 0.4, 0.8):
        assert np.abs(at(figure, shown, value) - spline(value)).max() < 2e-6


def test_it_goes_on_beyond_within_the_range_of_the_key(figure: bpy.types.Object, shown: Shown) -> None:
    bake(count=3)
    lean = figure.data.shape_keys.key_blocks["Lean"]
    lean.slider_min, lean.slider_max = -0.5, 1.25
    spline = path(figure)
    for value, end in ((-0.3, 0.0), (1.2, 1.0)):
        assert np.abs(at(figure, shown, value) - (spline(end) + (value - end) * spline(end, 1))).max() < 1e-5
    np.testing.assert_array_equal(at(figure, shown, 5.0), at(figure, shown, 1.25))


def test_a_property_a_bone_keyframes_and_a_strip_play_it(figure: bpy.types.Object, shown: Shown) -> None:
    keys = figure.data.shape_keys
    figure["smile"] = 0.0
    curve = keys.driver_add('key_blocks["Lean"].value')
    variable = curve.driver.variables.new()
    variable.name, variable.targets[0].id, variable.targets[0].data_path = "v", figure, '["smile"]'
    curve.driver.expression = "v"
    bake(count=3)
    spline = path(figure)
    assert np.abs(shown(figure, smile=0.3) - spline(0.3)).max() < 2e-6
    assert curve.driver.expression == "v"
    keys.driver_remove('key_blocks["Lean"].value')
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.new("control").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    curve = keys.driver_add('key_blocks["Lean"].value')
    curve.driver.type = 'AVERAGE'
    variable = curve.driver.variables.new()
    variable.type = 'TRANSFORMS'
    target = variable.targets[0]
    target.id, target.bone_target, target.transform_type = armature, "control", "LOC_X"
    target.transform_space = 'LOCAL_SPACE'
    armature.pose.bones["control"].location.x = 0.6
    bpy.context.view_layer.update()
    assert np.abs(shown(figure) - spline(0.6)).max() < 2e-6
    keys.driver_remove('key_blocks["Lean"].value')
    for frame, value in ((1, 0.0), (11, 1.0)):
        keys.key_blocks["Lean"].value = value
        keys.key_blocks["Lean"].keyframe_insert("value", frame=frame)
    bpy.context.scene.frame_set(4)
    place = keys.key_blocks["Lean"].value
    assert 0.1 < place < 0.5
    assert np.abs(shown(figure) - spline(place)).max() < 2e-6
    animation = keys.animation_data
    strip = animation.nla_tracks.new().strips.new("Strip", 21, animation.action)
    if hasattr(strip, "action_slot") and strip.action_slot is None:
        strip.action_slot = animation.action.slots[0]
    animation.action = None
    bpy.context.scene.frame_set(24)  # as frame 4 was
    assert keys.key_blocks["Lean"].value == pytest.approx(place, abs=1e-6)
    assert np.abs(shown(figure) - spline(place)).max() < 2e-6


def test_other_keys_add_as_they_did(figure: bpy.types.Object, shapes: ReadShapes, shown: Shown) -> None:
    bake(count=3)
    alone = at(figure, shown, 0.4)
    got = shapes(figure)
    figure.data.shape_keys.key_blocks["Stretch"].value = 0.5
    both = at(figure, shown, 0.4)
    assert np.abs(both - alone - 0.5 * (got["Stretch"] - got["Basis"])).max() < 1e-6


def test_a_key_that_is_relative_to_another(figure: bpy.types.Object, shapes: ReadShapes, shown: Shown) -> None:
    keys = figure.data.shape_keys.key_blocks
    keys["Stretch"].relative_key = keys["Lean"]
    bake(from_key="Lean", to_key="Stretch", count=3)
    chain, got = chain_of(figure), shapes(figure)
    assert chain.on_key == "Stretch"
    assert keys["Stretch_50"].relative_key == keys["Lean"]
    spline = path(figure)
    for lean in (0.0, 1.0):
        keys["Lean"].value = lean
        seen = at(figure, shown, 0.3, "Stretch")
        expected = got["Basis"] + lean * (got["Lean"] - got["Basis"]) + spline(0.3) - got["Lean"]
        assert np.abs(seen - expected).max() < 2e-6


def test_a_key_with_a_vertex_group_plays_as_it_shows(figure: bpy.types.Object, shown: Shown) -> None:
    group = figure.vertex_groups.new(name="Some")
    heights = [vertex.co.z for vertex in figure.data.vertices]
    for index, height in enumerate(heights):
        group.add([index], min(max(height, 0.0), 1.0), "REPLACE")
    figure.data.shape_keys.key_blocks["Lean"].vertex_group = "Some"
    rest, end = at(figure, shown, 0.0), at(figure, shown, 1.0)
    bake(count=3)
    np.testing.assert_allclose(at(figure, shown, 1.0), end, atol=1e-7)
    found = chain_shapes.step_shapes(figure, chain_of(figure))
    np.testing.assert_allclose(found[-1], end, atol=1e-6)
    parts = (at(figure, shown, 0.25) - rest) / np.where(np.abs(end - rest) > 0.01, end - rest, np.inf)
    moving = np.abs(end - rest) > 0.01
    np.testing.assert_allclose(parts[moving], parts[moving][0], atol=1e-3)
    assert 0.05 < parts[moving][0] < 0.2  # eased


def test_muted_it_shows_nothing_of_them(figure: bpy.types.Object, shown: Shown) -> None:
    rest = at(figure, shown, 0.0)
    bake(count=3)
    seen = at(figure, shown, 0.4)
    lean = figure.data.shape_keys.key_blocks["Lean"]
    lean.mute = True
    np.testing.assert_array_equal(at(figure, shown, 0.4), rest)
    lean.mute = False
    np.testing.assert_array_equal(at(figure, shown, 0.4), seen)


def test_baked_while_muted_that_is_said(figure: bpy.types.Object, capfd: pytest.CaptureFixture[str]) -> None:
    key = figure.data.shape_keys.key_blocks["Lean"]
    bake(count=2)
    assert "muted" not in capfd.readouterr().out
    key.mute = True
    bake(count=2)
    assert "'Lean' is muted, and its in-betweens with it; unmute it to see them play." in capfd.readouterr().out
    bake(count=2, play_on="slider")  # which plays whether the key is muted or not
    assert "'Lean' is muted" not in capfd.readouterr().out


def test_a_chain_goes_through_keys_at_values_of_the_last(
    figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
) -> None:
    bake(via=[{"name": "Stretch"}], count=1, easing="linear")
    chain, got = chain_of(figure), shapes(figure)
    assert (chain.on_key, list(got)[3:]) == ("Lean", ["Lean_25", "Lean_50", "Lean_75"])
    assert np.abs(at(figure, shown, 0.5) - got["Stretch"]).max() < 1e-6
    assert np.abs(at(figure, shown, 1.0) - got["Lean"]).max() < 1e-6


def test_baked_again_the_same_keys_get_new_shapes(figure: bpy.types.Object, shapes: ReadShapes, state: State) -> None:
    bake(count=3)
    before = state()
    bake(count=3)
    assert state() == before
    figure.data.shape_keys.key_blocks["Lean"].points[3].co.z += 1.0
    figure.data.shape_keys.key_blocks["Lean"].name = "Bow"
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    chain = chain_of(figure)
    assert (chain.on_key, chain.through) == ("Bow", ("Basis", "Bow"))
    assert list(shapes(figure))[3:] == ["Lean_25", "Lean_50", "Lean_75"]
    assert len(Record.read(figure.data.shape_keys).chains) == 1


def test_removed_the_old_rig_is_back(figure: bpy.types.Object, state: State) -> None:
    figure.data.shape_keys.key_blocks["Lean"].keyframe_insert("value", frame=3)
    before = state()
    bake(count=3)
    assert bpy.ops.qc3d.remove() == {"FINISHED"}
    after = state()
    after["keys"]["Key"]["drivers"] = before["keys"]["Key"]["drivers"]
    assert after == before
    assert not len(figure.data.shape_keys.animation_data.drivers)


def test_keyframes_are_those_of_the_key(figure: bpy.types.Object, shown: Shown) -> None:
    bake(count=3, use_keyframes=True, frame_start=1, frame_end=11)
    bpy.context.scene.frame_set(6)
    assert figure.data.shape_keys.key_blocks["Lean"].value == pytest.approx(0.5)
    assert bpy.ops.qc3d.to_keyframes(frame_start=1, frame_end=11) == {"FINISHED"}
    bpy.context.scene.frame_set(4)
    assert len(figure.data.shape_keys.animation_data.drivers) == 0
    assert figure.data.shape_keys.key_blocks["Lean"].value == pytest.approx(0.3)


def test_everything_else_can_be_done_with_it(
    figure: bpy.types.Object, shown: Shown, tmp_path: Path
) -> None:
    bake(count=3)
    choices: dict[str, dict[str, Any]] = {
        "export_alembic": {"filepath": str(tmp_path / "a.abc"), "frames": 3},
        "save_map": {"filepath": str(tmp_path / "a.qc3dmap")},
    }
    for name in ("heat_map", "select_worst", "absolute_keys", "export_alembic", "save_map", "live_scrub"):
        assert getattr(bpy.ops.qc3d, name)(slider="Lean", **choices.get(name, {})) == {"FINISHED"}, name
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
    copy = bpy.data.objects["Figure absolute"]
    for value in (0.0, 0.25, 0.4, 1.0):
        assert np.abs(at(figure, shown, value) - shown(copy)).max() < 5e-3


def test_a_duplicate_plays_by_itself(figure: bpy.types.Object, shown: Shown) -> None:
    bake(count=3)
    seen = at(figure, shown, 0.4)
    at(figure, shown, 0.0)
    bpy.ops.object.duplicate()
    copy = bpy.context.active_object
    np.testing.assert_array_equal(at(copy, shown, 0.4), seen)
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    np.testing.assert_array_equal(at(copy, shown, 0.4), seen)


def test_it_plays_in_a_saved_file_without_the_add_on(figure: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
    import qc3d_addon

    bake(count=3)
    seen = at(figure, shown, 0.4)
    at(figure, shown, 0.0)
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    qc3d_addon.unregister()
    try:
        bpy.ops.wm.open_mainfile(filepath=path, use_scripts=False)
        np.testing.assert_array_equal(at(bpy.data.objects["Figure"], shown, 0.4), seen)
    finally:
        qc3d_addon.register()


@pytest.mark.parametrize(
    ("choices", "sentence"),
    [
        ({"from_key": "Stretch", "play_on": "key"}, "'Lean' is relative to 'Basis', not to 'Stretch'; start from that"),
        ({"from_key": "Lean", "to_key": "Basis", "play_on": "key"}, "'Basis' is the Basis, which has no value"),
    ],
)
def test_what_it_cannot_be(figure: bpy.types.Object, state: State, choices: dict[str, str], sentence: str) -> None:
    before = state()
    with pytest.raises(RuntimeError, match=sentence):
        bake(**choices)
    assert state() == before


def test_left_alone_it_is_the_key_where_it_can_be(figure: bpy.types.Object) -> None:
    bake()
    assert chain_of(figure).on_key == "Lean"
    bake(to_key="Stretch", from_key="Lean")
    assert chain_of(figure).on_key == ""
    assert "Lean_to_Stretch" in figure


def test_drivers_move_values_only_and_need_no_scripts(figure: bpy.types.Object) -> None:
    """A driver of ``mute`` lets Blender's threads write values of the frame before back; an earlier bake's goes."""
    bake(count=3)
    keys = figure.data.shape_keys
    driver = keys.driver_add('key_blocks["Lean_50"].mute').driver
    driver.type = 'AVERAGE'
    variable = driver.variables.new()
    variable.name, target = "slider", variable.targets[0]
    target.id_type, target.id, target.data_path = 'KEY', keys, 'key_blocks["Lean"].mute'
    keys.key_blocks["Lean_50"].mute = True
    bake(count=3, quality="fine")
    assert not keys.key_blocks["Lean_50"].mute
    made = list(keys.animation_data.drivers)
    assert len(made) == 3
    assert all(curve.data_path.endswith("].value") for curve in made)
    assert all(curve.driver.is_simple_expression for curve in made)


def test_a_bake_with_other_places_knows_the_keys_of_the_one_before(figure: bpy.types.Object) -> None:
    for count in (1, 2, 3):
        bake(count=count)
        result = chain_of(figure).result
        assert result is not None
        assert not [note for note in result.notes if "without a record" in note]
