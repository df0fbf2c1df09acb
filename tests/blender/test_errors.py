# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever cannot be baked is refused with one sentence that says why, and the file stays exactly as it was."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.keys import drivers, shape_keys, slider
from qc3d_addon.solver.errors import MeshingError
from qc3d_addon.solver.frames import task
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.support.progress import Progress, Steps

State = Callable[[], dict[str, object]]
OPERATORS = [bpy.ops.qc3d.bake_inbetweens, bpy.ops.qc3d.prepare]


def refused(operator: Callable[..., Any], **choices: object) -> str:
    """The sentence with which an operator refuses."""
    with pytest.raises(RuntimeError) as caught:
        operator(**{"from_key": "Basis", "to_key": "Lean", **choices})
    text = str(caught.value).strip()
    assert "\n" not in text
    return text


@pytest.fixture(params=OPERATORS, ids=["bake", "prepare"])
def operator(request: pytest.FixtureRequest) -> Callable[..., Any]:
    return request.param


def no_object(figure: bpy.types.Object, folder: Path) -> str:
    bpy.context.view_layer.objects.active = None
    return "There is no active object; select a mesh with shape keys."


def no_mesh(figure: bpy.types.Object, folder: Path) -> str:
    empty = bpy.data.objects.new("Marker", None)
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.objects.active = empty
    return "'Marker' is not a mesh; select a mesh with shape keys."


def no_keys(figure: bpy.types.Object, folder: Path) -> str:
    figure.shape_key_clear()
    return "'Figure' has fewer than two shape keys; add a second one."


def one_key(figure: bpy.types.Object, folder: Path) -> str:
    figure.shape_key_clear()
    figure.shape_key_add(name="Basis")
    return "'Figure' has fewer than two shape keys; add a second one."


def edit_mode(figure: bpy.types.Object, folder: Path) -> str:
    bpy.ops.object.mode_set(mode='EDIT')
    return "'Figure' is being edited; go back to Object Mode first."


def sculpt_mode(figure: bpy.types.Object, folder: Path) -> str:
    bpy.ops.object.mode_set(mode='SCULPT')
    return "'Figure' is being edited; go back to Object Mode first."


def sculpted_through_another_object(figure: bpy.types.Object, folder: Path) -> str:
    twin = bpy.data.objects.new("Twin", figure.data)
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.objects.active = twin
    bpy.ops.object.mode_set(mode='SCULPT')
    bpy.context.view_layer.objects.active = figure
    return "'Twin', which shares its mesh, is being edited; go back to Object Mode first."


def absolute_keys(figure: bpy.types.Object, folder: Path) -> str:
    figure.data.shape_keys.use_relative = False
    return "The shape keys of 'Figure' are absolute; enable Relative, which in-betweens need."


def linked_object(figure: bpy.types.Object, folder: Path) -> str:
    link_from_library(folder)
    return "'Figure' is linked from a library and cannot be changed; make it local first."


def linked_mesh(figure: bpy.types.Object, folder: Path) -> str:
    mesh = link_from_library(folder).data
    obj = bpy.data.objects.new("Instance", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    return "'Figure' is linked from a library and cannot be changed; make it local first."


def overridden_object(figure: bpy.types.Object, folder: Path) -> str:
    override = link_from_library(folder).override_create(remap_local_usages=True)
    bpy.context.view_layer.objects.active = override
    return "'Figure' is a library override and cannot take new shape keys; make it local first."


def link_from_library(folder: Path) -> bpy.types.Object:
    path = str(folder / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, linked):
        linked.objects = ["Figure"]
    obj = linked.objects[0]
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    return obj


@pytest.mark.parametrize(
    "spoil",
    [
        no_object,
        no_mesh,
        no_keys,
        one_key,
        edit_mode,
        sculpt_mode,
        sculpted_through_another_object,
        absolute_keys,
        linked_object,
        linked_mesh,
        overridden_object,
    ],
)
def test_objects_that_cannot_be_baked(
    operator: Callable[..., Any], figure: bpy.types.Object, state: State, tmp_path: Path, spoil: Callable[..., str]
) -> None:
    sentence = spoil(figure, tmp_path)
    before = state()
    assert refused(operator).endswith(sentence)
    assert state() == before


@pytest.mark.parametrize(
    ("choices", "sentence"),
    [
        ({"to_key": "Basis"}, "'Basis' is both the first and the second key; choose two different keys."),
        ({"from_key": "Grin"}, "There is no shape key 'Grin'; choose the first key from those of the mesh."),
        ({"to_key": "Grin"}, "There is no shape key 'Grin'; choose the second key from those of the mesh."),
        ({"from_key": ""}, "Choose the first key."),
        ({"to_key": ""}, "Choose the second key."),
    ],
)
def test_names_that_are_not_two_keys(
    operator: Callable[..., Any], figure: bpy.types.Object, state: State, choices: dict[str, str], sentence: str
) -> None:
    before = state()
    assert refused(operator, **choices) == f"Error: {sentence}"
    assert state() == before


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(("key", "which"), [("Basis", "first"), ("Lean", "second")])
def test_coordinates_that_are_not_finite(
    operator: Callable[..., Any], figure: bpy.types.Object, state: State, key: str, which: str, value: float
) -> None:
    points = figure.data.shape_keys.key_blocks[key].points
    values = np.empty(3 * len(points), dtype=np.float32)
    points.foreach_get("co", values)
    values[3 * 7 + 1] = value
    points.foreach_set("co", values)  # a single coordinate set to infinity would be made finite by Blender
    before = state()
    assert f"Vertex 7 of the {which} key has a coordinate that is not finite" in refused(operator)
    assert state() == before


def object_of(corners: list[tuple[int, int, int]]) -> bpy.types.Object:
    """An active object with these vertices and two equal shape keys."""
    mesh = bpy.data.meshes.new("Flat")
    mesh.from_pydata(corners, [], [tuple(range(len(corners)))] if len(corners) > 2 else [])
    obj = bpy.data.objects.new("Flat", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Lean", from_mix=False)
    return obj


def test_a_mesh_without_vertices(operator: Callable[..., Any], state: State) -> None:
    object_of([])
    before = state()
    assert "The mesh has no vertices" in refused(operator)
    assert state() == before


@pytest.mark.usefixtures("quick_map")
@pytest.mark.parametrize(
    "corners",
    [[(1, 2, 3)], [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(1, 2, 3)] * 5],
    ids=["a vertex", "a triangle", "a flat quadrilateral", "all in one place"],
)
@pytest.mark.parametrize("mode", ["natural", "straight"])
def test_meshes_that_span_no_volume_bake(corners: list[tuple[int, int, int]], mode: str) -> None:
    obj = object_of(corners)
    lean = obj.data.shape_keys.key_blocks["Lean"]
    lean.points.foreach_set("co", np.add(corners, [0.0, 0.0, 2.0]).astype(np.float32).ravel())
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key="Lean", count=1, mode=mode
    ) == {'FINISHED'}
    middle = np.empty((len(corners), 3), dtype=np.float32)
    obj.data.shape_keys.key_blocks[2].points.foreach_get("co", middle.ravel())
    np.testing.assert_allclose(middle, np.add(corners, [0.0, 0.0, 1.0]), atol=1e-5)


def test_keyframes_that_leave_no_time(figure: bpy.types.Object, state: State) -> None:
    before = state()
    said = refused(bpy.ops.qc3d.bake_inbetweens, use_keyframes=True, frame_start=5, frame_end=5)
    assert said == "Error: Keyframes from 5 to 5 are not possible; the last must come after the first."
    assert state() == before


@pytest.mark.usefixtures("quick_map")
class TestLaterFailures:
    """With a bake in the file, and the next one, of another number and a sculpted key, going wrong on its way."""

    @pytest.fixture
    def baked(self, figure: bpy.types.Object) -> bpy.types.Object:
        bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=2)
        figure.data.shape_keys.key_blocks["Lean"].points[0].co.x += 0.5
        figure.active_shape_key_index = 4
        return figure

    @pytest.fixture
    def bake(self) -> Callable[..., str]:
        return lambda **choices: refused(bpy.ops.qc3d.bake_inbetweens, **{"count": 5, "play_on": "slider", **choices})

    def test_a_locked_key_that_is_only_read_is_no_obstacle(self, baked: bpy.types.Object) -> None:
        baked.data.shape_keys.key_blocks["Lean"].lock_shape = True
        assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean") == {'FINISHED'}

    def test_a_map_that_is_not_found(
        self, baked: bpy.types.Object, state: State, bake: Callable[..., str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def fit_pair(*arguments: object) -> Iterator[Progress]:
            yield Progress("fit", 0.5)
            raise MeshingError("No map without folds was found; try a finer quality.")

        monkeypatch.setattr(task, "fit_pair", fit_pair)
        before = state()
        assert bake() == "Error: No map without folds was found; try a finer quality."
        assert refused(bpy.ops.qc3d.prepare) == "Error: No map without folds was found; try a finer quality."
        assert state() == before

    @pytest.mark.parametrize(("value", "said"), [(np.nan, "not finite"), (1e300, "not finite")])
    def test_frames_that_no_key_can_hold(
        self,
        baked: bpy.types.Object,
        state: State,
        bake: Callable[..., str],
        monkeypatch: pytest.MonkeyPatch,
        value: float,
        said: str,
    ) -> None:
        chain_frames = task.chain_frames

        def spoiled(*arguments: object) -> Steps[Bake]:
            made = yield from chain_frames(*arguments)
            made.frames[2, 4, 1] = value
            return made

        monkeypatch.setattr(task, "chain_frames", spoiled)
        before = state()
        assert said in bake()
        assert state() == before

    @pytest.mark.parametrize(
        ("module", "function", "call"),
        [
            (shape_keys, "set_key_coordinates", 1),
            (shape_keys, "set_key_coordinates", 4),
            (drivers, "drive_value", 1),
            (drivers, "drive_value", 3),
            (slider, "begin_keyframes", 1),
        ],
    )
    @pytest.mark.parametrize("to_key", ["Lean", "Stretch"])
    def test_a_failure_while_writing(
        self,
        baked: bpy.types.Object,
        state: State,
        bake: Callable[..., str],
        monkeypatch: pytest.MonkeyPatch,
        module: ModuleType,
        function: str,
        call: int,
        to_key: str,
    ) -> None:
        original, calls = getattr(module, function), []

        def failing(*arguments: object) -> object:
            calls.append(arguments)
            if len(calls) == call:
                raise MeshingError("The disk is on fire.")
            return original(*arguments)

        monkeypatch.setattr(module, function, failing)
        before = state()
        assert bake(to_key=to_key, use_keyframes=True) == "Error: The disk is on fire."
        assert state() == before
        bpy.context.view_layer.update()  # what was taken back left nothing that Blender stumbles over

    def test_a_damaged_record(self, baked: bpy.types.Object, state: State, bake: Callable[..., str]) -> None:
        for damaged in ("{", "[]", '{"chains": [{}], "maps": []}', 7, '{"chains": [], "maps": [{"a": 1}]}'):
            baked.data.shape_keys["qc3d"] = damaged
            before = state()
            assert "The record of earlier bakes on 'Key' is damaged" in bake()
            assert state() == before
