# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operations on baked in-betweens: remove, keyframe, copy, mirror, export."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender import compat
from qc3d_addon.blender.heat_map import heat_map
from qc3d_addon.blender.keys.control import value_path
from qc3d_addon.blender.store import kept_measures
from qc3d_addon.blender.store.records import PROPERTY, Record

pytestmark = pytest.mark.usefixtures("quick_map")

SLIDER = "Basis_to_Lean"
Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]

OPERATORS = (
    "remove",
    "to_keyframes",
    "absolute_keys",
    "mirror",
    "export_alembic",
    "save_map",
    "select_worst",
    "heat_map",
    "rebake",
)


def bake(to_key: str = "Lean", **choices: object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key=to_key, mode="linear", **choices
    ) == {"FINISHED"}


@pytest.mark.parametrize("name", OPERATORS)
def test_there_must_be_in_betweens(figure: bpy.types.Object, name: str) -> None:
    operator = getattr(bpy.ops.qc3d, name)
    assert not operator.poll()
    with pytest.raises(RuntimeError, match="'Figure' has no in-betweens yet; bake some first"):
        operator()


@pytest.mark.parametrize("name", OPERATORS)
def test_the_slider_must_be_one_of_them(figure: bpy.types.Object, name: str, state: State) -> None:
    bake()
    before = state()
    with pytest.raises(RuntimeError, match="'Figure' has no in-betweens with the slider 'Other'"):
        getattr(bpy.ops.qc3d, name)(slider="Other")
    assert state() == before


class TestRemove:
    def test_all_of_one_bake(self, figure: bpy.types.Object, state: State) -> None:
        before = state()
        bake(use_keyframes=True)
        bpy.ops.qc3d.heat_map(measure="stretch")
        assert bpy.ops.qc3d.remove() == {"FINISHED"}
        assert state() == before
        assert not bpy.data.actions
        assert not bpy.data.node_groups
        assert PROPERTY not in figure.data.shape_keys
        assert not list(figure.data.shape_keys.keys())

    def test_others_stay(self, figure: bpy.types.Object, state: State, shown: Shown) -> None:
        bake()
        there = shown(figure, **{SLIDER: 0.6})
        before = state()
        bake("Stretch")
        assert bpy.ops.qc3d.remove() == {"FINISHED"}  # the newest
        assert state() == before
        np.testing.assert_array_equal(shown(figure, **{SLIDER: 0.6}), there)
        assert len(Record.read(figure.data.shape_keys).maps) == 1

    def test_the_active_key_stays_active(self, figure: bpy.types.Object) -> None:
        bake()
        figure.active_shape_key_index = 1
        bpy.ops.qc3d.remove()
        assert figure.active_shape_key.name == "Lean"

    def test_what_the_animator_hung_on_the_slider_stays(self, figure: bpy.types.Object) -> None:
        bake()
        lamp = bpy.data.objects.new("Lamp", None)
        bpy.context.collection.objects.link(lamp)
        curve = lamp.driver_add("location", 0)
        variable = curve.driver.variables.new()
        variable.targets[0].id = figure
        variable.targets[0].data_path = f'["{SLIDER}"]'
        assert bpy.ops.qc3d.remove() == {"FINISHED"}
        assert SLIDER in figure
        lamp.driver_remove("location", 0)

    def test_a_driver_of_what_was_deleted_is_no_reason_to_stay(self, figure: bpy.types.Object) -> None:
        bake()
        bpy.ops.qc3d.absolute_keys()
        bpy.data.objects.remove(bpy.data.objects["Figure absolute"])  # its mesh, its keys and their driver are there
        assert len(bpy.data.shape_keys) == 2
        assert bpy.ops.qc3d.remove() == {"FINISHED"}
        assert SLIDER not in figure

    def test_the_animators_own_keyframes_stay(self, figure: bpy.types.Object) -> None:
        bake()
        figure.keyframe_insert(f'["{SLIDER}"]', frame=7)
        assert bpy.ops.qc3d.remove() == {"FINISHED"}
        assert SLIDER not in figure
        assert compat.find_fcurve(figure, f'["{SLIDER}"]') is not None

    def test_a_locked_key(self, figure: bpy.types.Object, state: State) -> None:
        bake()
        figure.data.shape_keys.key_blocks[-1].lock_shape = True
        before = state()
        with pytest.raises(RuntimeError, match="is locked; unlock it"):
            bpy.ops.qc3d.remove()
        assert state() == before


def keep_action_elsewhere(block: bpy.types.ID, folder: Path) -> None:
    """Put the action of an object or of keys into a file of its own, and link it back."""
    action, path = block.animation_data.action, str(folder / "action.blend")
    slot = getattr(block.animation_data, "action_slot", None)
    identifier = None if slot is None else slot.identifier
    bpy.data.libraries.write(path, {action})
    bpy.data.actions.remove(action)
    with bpy.data.libraries.load(path, link=True) as (there, here):
        here.actions = there.actions
    block.animation_data.action = here.actions[0]
    if identifier is not None:
        block.animation_data.action_slot = here.actions[0].slots[identifier]


class TestLinkedActions:
    """What is in another file cannot be changed: it is found out before anything is."""

    @pytest.mark.parametrize("name", ["remove", "to_keyframes"])
    def test_of_the_slider(self, figure: bpy.types.Object, state: State, tmp_path: Path, name: str) -> None:
        bake(use_keyframes=True)
        keep_action_elsewhere(figure, tmp_path)
        before = state()
        with pytest.raises(RuntimeError, match=r"The action '.*' is linked; make it local first"):
            getattr(bpy.ops.qc3d, name)()
        assert state() == before

    def test_of_the_keys(self, figure: bpy.types.Object, state: State, tmp_path: Path) -> None:
        bake()
        figure.data.shape_keys.key_blocks["Stretch"].keyframe_insert("value", frame=1)
        keep_action_elsewhere(figure.data.shape_keys, tmp_path)
        before = state()
        with pytest.raises(RuntimeError, match=r"The action '.*' is linked; make it local first"):
            bpy.ops.qc3d.to_keyframes()
        assert state() == before
        assert bpy.ops.qc3d.remove() == {"FINISHED"}

    def test_a_bake_with_keyframes(self, figure: bpy.types.Object, state: State, tmp_path: Path) -> None:
        figure.keyframe_insert("location", frame=1)
        keep_action_elsewhere(figure, tmp_path)
        before = state()
        with pytest.raises(RuntimeError, match=r"The action '.*' is linked; make it local first"):
            bake(use_keyframes=True)
        assert state() == before
        bake()


class TestToKeyframes:
    def frames(self, obj: bpy.types.Object, frames: range) -> np.ndarray:
        shapes = []
        for frame in frames:
            bpy.context.scene.frame_set(frame)
            mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
            mesh.vertices.foreach_get("co", values)
            shapes.append(values)
        return np.stack(shapes)

    def test_every_frame_looks_as_before(self, figure: bpy.types.Object, slider_drivers: Callable[..., Any]) -> None:
        bake(count=3, use_keyframes=True, frame_start=3, frame_end=20)
        expected = self.frames(figure, range(1, 25))
        bpy.context.scene.frame_set(11)
        assert bpy.ops.qc3d.to_keyframes(frame_start=1, frame_end=24) == {"FINISHED"}
        assert bpy.context.scene.frame_current == 11
        assert np.abs(self.frames(figure, range(1, 25)) - expected).max() < 1e-6
        assert not slider_drivers(figure, SLIDER)
        assert SLIDER not in figure
        assert not Record.read(figure.data.shape_keys).chains
        keys = figure.data.shape_keys
        curve = compat.find_fcurve(keys, 'key_blocks["Basis_to_Lean_50"].value')
        assert curve is not None
        assert {point.interpolation for point in curve.keyframe_points} == {"LINEAR"}
        assert len(curve.keyframe_points) < 24  # no keyframes where the value goes on as it does
        if hasattr(keys.animation_data, "action_slot"):
            assert keys.animation_data.action_slot is not None

    def test_a_slider_without_animation_stands_still(self, figure: bpy.types.Object, shown: Shown) -> None:
        bake(count=1)
        there = shown(figure, **{SLIDER: 0.4})
        assert bpy.ops.qc3d.to_keyframes() == {"FINISHED"}
        np.testing.assert_allclose(self.frames(figure, range(1, 3)).reshape(2, -1, 3), [there, there], atol=1e-6)

    def test_a_slider_that_something_else_drives(self, figure: bpy.types.Object) -> None:
        bake(count=3)
        curve = figure.driver_add(f'["{SLIDER}"]')
        curve.driver.expression = "frame / 10"
        expected = self.frames(figure, range(11))
        assert bpy.ops.qc3d.to_keyframes(frame_start=0, frame_end=10) == {"FINISHED"}
        assert np.abs(self.frames(figure, range(11)) - expected).max() < 1e-6

    @pytest.mark.parametrize(("first", "last"), [(5, 5), (6, 5), (0, 200_000)])
    def test_frames_that_are_none(self, figure: bpy.types.Object, state: State, first: int, last: int) -> None:
        bake()
        before = state()
        with pytest.raises(RuntimeError, match=f"Frames {first} to {last} are not possible"):
            bpy.ops.qc3d.to_keyframes(frame_start=first, frame_end=last)
        assert state() == before

    def test_keyframes_under_a_driver_are_replaced_with_a_word(
        self, figure: bpy.types.Object, capfd: pytest.CaptureFixture[str]
    ) -> None:
        bake(count=1)
        key = figure.data.shape_keys.key_blocks[f"{SLIDER}_50"]
        curve = compat.ensure_fcurve(figure.data.shape_keys, value_path(key.name), ExitStack())
        curve.keyframe_points.insert(7, 0.25)
        assert bpy.ops.qc3d.to_keyframes(frame_start=1, frame_end=3) == {"FINISHED"}
        assert [point.co.x for point in curve.keyframe_points] == [1.0, 3.0]
        said = "".join(capfd.readouterr())
        assert f"Keyframes of '{SLIDER}_50', which its driver had overridden, were replaced" in said

    def test_a_deleted_slider(self, figure: bpy.types.Object) -> None:
        bake()
        del figure[SLIDER]
        with pytest.raises(RuntimeError, match="was deleted; re-bake it first"):
            bpy.ops.qc3d.to_keyframes()


class TestAbsoluteKeys:
    def test_a_deleted_step(self, figure: bpy.types.Object, state: State) -> None:
        bake(count=3)
        figure.active_shape_key_index = figure.data.shape_keys.key_blocks.find(f"{SLIDER}_50")
        bpy.ops.object.shape_key_remove()
        before = state()
        with pytest.raises(RuntimeError, match=f"Shape keys of '{SLIDER}' were deleted; re-bake it first"):
            bpy.ops.qc3d.absolute_keys()
        assert state() == before

    def test_no_keys_and_no_heat_map_of_the_original_stay_with_it(self, figure: bpy.types.Object) -> None:
        bake(count=1)
        assert bpy.ops.qc3d.heat_map() == {"FINISHED"}
        assert bpy.ops.qc3d.absolute_keys() == {"FINISHED"}
        copy = bpy.data.objects["Figure absolute"]
        assert len(bpy.data.shape_keys) == 2
        assert not copy.modifiers
        assert not [attribute.name for attribute in copy.data.attributes if "QC3D" in attribute.name]
        assert heat_map.shown(figure) is not None
        assert bpy.data.node_groups[0].users == 1

    def test_the_copy_plays_as_the_original(self, figure: bpy.types.Object, shown: Shown, state: State) -> None:
        bake(count=3)
        keys = figure.data.shape_keys
        before = state()["keys"][keys.name]
        assert bpy.ops.qc3d.absolute_keys() == {"FINISHED"}
        copy = bpy.data.objects["Figure absolute"]
        assert not copy.data.shape_keys.use_relative
        assert copy.data.shape_keys.key_blocks.keys()[::6] == [f"{SLIDER}_{place}" for place in ("00", 25, 50, 75, 100)]
        assert state()["keys"][keys.name] == before
        for place in (0.0, 0.25, 0.3, 0.5, 0.9, 1.0):
            expected = shown(figure, **{SLIDER: place})
            assert np.abs(shown(copy) - expected).max() < 1e-5
        assert not [name for name in (*copy.keys(), *copy.data.shape_keys.keys()) if "qc3d" in name]

    def test_where_no_step_is_the_basis(self, figure: bpy.types.Object, shown: Shown) -> None:
        bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Lean", to_key="Stretch", mode="linear", count=2)
        bpy.ops.qc3d.absolute_keys()
        copy = bpy.data.objects["Figure absolute"]
        for place in (0.0, 0.5, 1.0):
            expected = shown(figure, Lean_to_Stretch=place)
            assert np.abs(shown(copy) - expected).max() < 1e-5


@pytest.fixture
def even() -> bpy.types.Object:
    """The active object "Even": a sphere of meridians, which an icosphere is not symmetric like."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    obj = bpy.context.active_object
    obj.name = obj.data.name = "Even"
    for name, lean in (("Basis", 0.0), ("Lean", 0.4)):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0
        for point in key.points:
            point.co.x += lean * max(point.co.z, 0.0) ** 2
    return obj


class TestMirror:
    def mirrored(self, shape: np.ndarray, rest: np.ndarray) -> np.ndarray:
        images = rest * [-1, 1, 1]
        partner = np.linalg.norm(images[:, None] - rest[None], axis=2).argmin(axis=1)
        return np.asarray(shape[partner] * np.array([-1, 1, 1], dtype=np.float32))

    def test_every_step(self, even: bpy.types.Object, shapes: ReadShapes, shown: Shown) -> None:
        even.data.shape_keys.key_blocks["Lean"].name = "Lean.L"
        bake("Lean.L", count=2)
        there = shown(even, **{"Basis_to_Lean.L": 0.5})
        rest = shapes(even)["Basis"]
        even["Basis_to_Lean.L"] = 0.0
        assert bpy.ops.qc3d.mirror() == {"FINISHED"}
        got = shapes(even)
        for step in (1, 2, 3):
            expected = self.mirrored(got[f"Basis_to_Lean.L_{100 * step / 3:.0f}"], rest)
            np.testing.assert_array_equal(got[f"Basis_to_Lean.R_{100 * step / 3:.0f}"], expected)
        seen = shown(even, **{"Basis_to_Lean.R": 0.5})
        assert np.abs(seen - self.mirrored(there, rest)).max() < 1e-6

    def test_again_it_is_brought_up_to_date(self, even: bpy.types.Object, shapes: ReadShapes) -> None:
        bake(count=1)
        bpy.ops.qc3d.mirror(slider=SLIDER)
        for point in even.data.shape_keys.key_blocks["Lean"].points:
            point.co.y += point.co.z
        bpy.ops.qc3d.rebake(slider=SLIDER)
        names = list(shapes(even))
        bpy.ops.qc3d.mirror(slider=SLIDER)
        got = shapes(even)
        assert list(got) == names
        expected = self.mirrored(got["Basis_to_Lean_100"], got["Basis"])
        np.testing.assert_array_equal(got["Basis_to_Lean_mirrored_100"], expected)
        assert bpy.ops.qc3d.remove(slider="Basis_to_Lean_mirrored") == {"FINISHED"}
        assert [name for name in shapes(even) if "_to_" in name] == ["Basis_to_Lean_50", "Basis_to_Lean_100"]

    def test_it_shows_the_same_result_at_the_other_side(self, even: bpy.types.Object, shown: Shown) -> None:
        bake(count=2)
        bpy.ops.qc3d.mirror()
        ours, image = Record.read(even.data.shape_keys).chains
        assert image.mirror_of == ours.slider
        worst = [chain.result.worst.vertex for chain in (ours, image)]
        rest = [np.array(even.data.vertices[vertex].co) for vertex in worst]
        np.testing.assert_allclose(rest[1], rest[0] * [-1, 1, 1], atol=1e-6)
        assert replace(ours.result, worst=None) == replace(image.result, worst=None)
        keys, count = even.data.shape_keys, len(even.data.vertices)
        kept = [kept_measures.read(keys, chain.slider, count) for chain in (ours, image)]
        for name in kept_measures.MEASURES:
            np.testing.assert_array_equal(kept[0][name][:, worst[0]], kept[1][name][:, worst[1]])
            np.testing.assert_array_equal(np.sort(kept[0][name]), np.sort(kept[1][name]))
        assert bpy.ops.qc3d.heat_map(slider=image.slider) == {"FINISHED"}
        assert bpy.ops.qc3d.select_worst(slider=image.slider) == {"FINISHED"}

    @pytest.mark.parametrize("name", ["rebake", "live_scrub", "save_map"])
    def test_what_needs_keys_of_its_own(self, even: bpy.types.Object, name: str, state: State) -> None:
        bake(count=1)
        bpy.ops.qc3d.mirror()
        before = state()
        with pytest.raises(RuntimeError, match="is the mirror image of 'Basis_to_Lean'; mirror that one again"):
            getattr(bpy.ops.qc3d, name)(**({"filepath": "/none/none"} if name == "save_map" else {}))
        with pytest.raises(RuntimeError, match="is itself the mirror image of 'Basis_to_Lean'; choose that one"):
            bpy.ops.qc3d.mirror()
        assert state() == before

    def test_keys_of_the_other_side_are_not_overwritten(self, even: bpy.types.Object, state: State) -> None:
        even.data.shape_keys.key_blocks["Lean"].name = "Lean.L"
        other = even.shape_key_add(name="Lean.R", from_mix=False)
        for point in other.points:
            point.co.x -= 0.2 * max(point.co.z, 0.0)
        bake("Lean.L", count=1)
        bake("Lean.R", count=1)
        before = state()
        with pytest.raises(RuntimeError, match=r"'Basis_to_Lean\.R' was baked from its own keys; remove it before"):
            bpy.ops.qc3d.mirror(slider="Basis_to_Lean.L")
        assert state() == before
        bpy.ops.qc3d.remove(slider="Basis_to_Lean.R")
        assert bpy.ops.qc3d.mirror(slider="Basis_to_Lean.L") == {"FINISHED"}
        # With a key of its own, a mirror image can be made from that one instead.
        assert bpy.ops.qc3d.rebake(slider="Basis_to_Lean.R") == {"FINISHED"}
        assert Record.read(even.data.shape_keys).chain_of_slider("Basis_to_Lean.R").mirror_of == ""

    def test_a_shape_without_symmetry(self, even: bpy.types.Object, state: State) -> None:
        for point in even.data.shape_keys.key_blocks["Basis"].points:
            point.co.x += 0.01 if point.co.x > 0.5 else 0.0
        bake()
        before = state()
        with pytest.raises(RuntimeError, match=r"of 42 vertices have no mirror image across x = 0"):
            bpy.ops.qc3d.mirror()
        assert state() == before


class TestAlembic:
    def test_the_file_plays_the_slider(
        self, figure: bpy.types.Object, tmp_path: Path, state: State, shown: Shown
    ) -> None:
        bake(count=3)
        expected = [shown(figure, **{SLIDER: place}) for place in (0.0, 0.5, 1.0)]
        figure[SLIDER] = 0.25
        before = state()
        path = tmp_path / "figure"
        assert bpy.ops.qc3d.export_alembic(filepath=str(path), frames=9) == {"FINISHED"}
        assert state() == before
        assert bpy.context.active_object == figure
        bpy.ops.wm.alembic_import(filepath=str(path.with_suffix(".abc")), as_background_job=False)
        imported = bpy.context.active_object
        assert imported != figure
        for frame, shape in zip((1, 5, 9), expected, strict=True):
            bpy.context.scene.frame_set(frame)
            seen = shown(imported) @ np.array(imported.matrix_world.to_3x3()).T
            assert np.abs(seen - shape).max() < 1e-5

    def test_no_file(self, figure: bpy.types.Object, tmp_path: Path, state: State) -> None:
        bake()
        before = state()
        with pytest.raises(RuntimeError, match="Name a file"):
            bpy.ops.qc3d.export_alembic(frames=9)
        with pytest.raises(RuntimeError, match="cannot be written"):
            bpy.ops.qc3d.export_alembic(filepath=str(tmp_path / "none" / "a.abc"), frames=9)
        assert state() == before
