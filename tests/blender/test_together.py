# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several objects of one character, baked in one map."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.bake.run import bake_objects_together
from qc3d_addon.blender.store.records import Record
from qc3d_addon.cli import main
from qc3d_addon.solver.settings import FrameOptions

from .conftest import add_key

Shown = Callable[..., np.ndarray]

pytestmark = pytest.mark.usefixtures("work_here")


def lean(points: np.ndarray) -> np.ndarray:
    return points + np.maximum(points[:, 2:], 0.0) ** 2 * [0.8, 0.1, -0.3]


@pytest.fixture
def hat(figure: bpy.types.Object) -> bpy.types.Object:
    """An object of its own, moved, turned and stretched, whose vertices are some of the figure's; keys Basis, Lean."""
    mesh = figure.data
    assert isinstance(mesh, bpy.types.Mesh)
    points = np.array([vertex.co[:] for vertex in mesh.vertices])
    faces = [list(polygon.vertices) for polygon in mesh.polygons if all(points[v][2] > 0.3 for v in polygon.vertices)]
    used, corners = np.unique(np.concatenate(faces), return_inverse=True)
    obj = bpy.data.objects.new("Hat", bpy.data.meshes.new("Hat"))
    bpy.context.collection.objects.link(obj)
    obj.location, obj.rotation_euler, obj.scale = (0.5, 0.2, -0.1), (0.0, 0.0, 0.4), (1.0, 2.0, 1.0)
    bpy.context.view_layer.update()
    back = np.linalg.inv(np.array(obj.matrix_world))
    own = points[used] @ back[:3, :3].T + back[:3, 3]
    obj.data.from_pydata(own.tolist(), [], corners.reshape(-1, 3).tolist())
    leant = lean_of(figure)[used] @ back[:3, :3].T + back[:3, 3]
    add_key(obj, "Basis", lambda rest: rest)
    add_key(obj, "Lean", lambda rest: leant)
    obj["used"] = used.tolist()
    for each in (figure, obj):
        each.select_set(True)
    bpy.context.view_layer.objects.active = figure
    return obj


def lean_of(obj: bpy.types.Object) -> np.ndarray:
    return np.array([point.co[:] for point in obj.data.shape_keys.key_blocks["Lean"].points])


def world(obj: bpy.types.Object, points: np.ndarray) -> np.ndarray:
    matrix = np.array(obj.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def apart(figure: bpy.types.Object, hat: bpy.types.Object, shown: Shown) -> float:
    used = np.array(hat["used"][:])
    return float(np.abs(world(figure, shown(figure))[used] - world(hat, shown(hat))).max())


def bake(**choices: object) -> None:
    found = bpy.ops.qc3d.bake_objects(from_key="Basis", to_key="Lean", count=3, **choices)
    assert found == {'FINISHED'}


def test_hidden_objects_are_where_they_belong(
    figure: bpy.types.Object, hat: bpy.types.Object, shown: Shown
) -> None:
    """Blender leaves hidden ones where they were last seen: at the origin, where a file was opened."""
    hat.hide_viewport = True
    figure.location.x += 2.0
    hat.location.x += 2.0
    before = len(bpy.data.objects)
    bake_objects_together([figure, hat], BakeRequest(("Basis", "Lean"), 3, frame_options=FrameOptions("straight")))
    assert len(bpy.data.objects) == before
    hat.hide_viewport = False
    for value in (0.0, 0.3, 1.0):
        figure.data.shape_keys.key_blocks["Lean"].value = value
        bpy.context.view_layer.update()
        assert apart(figure, hat, shown) < 1e-5


@pytest.mark.parametrize("play_on", ["key", "slider"])
def test_one_control_plays_all_and_nothing_comes_apart(
    figure: bpy.types.Object, hat: bpy.types.Object, shown: Shown, play_on: str
) -> None:
    bake(play_on=play_on)
    chains = [Record.read(obj.data.shape_keys).chains for obj in (figure, hat)]
    assert [len(of_object) for of_object in chains] == [1, 1]
    assert "Baked together with 'Figure'; Re-Bake bakes 'Hat' by itself." in chains[1][0].result.notes
    for place in (0.0, 0.1, 0.5, 0.8, 1.0):
        if play_on == "key":
            figure.data.shape_keys.key_blocks["Lean"].value = place
        else:
            figure[chains[0][0].slider] = place
        figure.update_tag()
        bpy.context.view_layer.update()
        assert apart(figure, hat, shown) < 2e-6
    basis = np.array([point.co[:] for point in hat.data.shape_keys.key_blocks["Basis"].points])
    assert np.abs(shown(hat) - basis).max() > 0.1


def test_each_on_its_own(figure: bpy.types.Object, hat: bpy.types.Object, shown: Shown) -> None:
    bake(one_control=False, play_on="key")
    keys = hat.data.shape_keys
    assert keys.animation_data.drivers.find('key_blocks["Lean"].value') is None
    for obj in (figure, hat):
        obj.data.shape_keys.key_blocks["Lean"].value = 0.5
        obj.update_tag()
    bpy.context.view_layer.update()
    assert apart(figure, hat, shown) < 2e-6


def test_a_driver_of_the_users_own_stays(figure: bpy.types.Object, hat: bpy.types.Object) -> None:
    own = hat.data.shape_keys.driver_add('key_blocks["Lean"].value')
    own.driver.expression = "0.25"
    bake(play_on="key")
    assert hat.data.shape_keys.animation_data.drivers.find('key_blocks["Lean"].value').driver.expression == "0.25"


def test_removed_again_without_broken_drivers(figure: bpy.types.Object, hat: bpy.types.Object) -> None:
    bake(play_on="slider")
    for obj in (hat, figure):
        bpy.context.view_layer.objects.active = obj
        assert bpy.ops.qc3d.remove() == {'FINISHED'}
    for block in (figure, hat, figure.data.shape_keys, hat.data.shape_keys):
        assert block.animation_data is None or not len(block.animation_data.drivers)


def test_what_has_not_the_keys_is_left_out(figure: bpy.types.Object, hat: bpy.types.Object) -> None:
    hat.data.shape_keys.key_blocks["Lean"].name = "Other"
    bake()
    assert not Record.read(hat.data.shape_keys).chains
    assert len(Record.read(figure.data.shape_keys).chains) == 1


def test_changed_meanwhile_nothing_is_written(
    figure: bpy.types.Object, hat: bpy.types.Object, monkeypatch: pytest.MonkeyPatch
) -> None:
    from qc3d_addon.worker import client

    run = client.run

    def meanwhile(*arguments: object) -> object:
        outcome = run(*arguments)  # type: ignore[arg-type]
        hat.data.shape_keys.key_blocks["Lean"].points[0].co.x += 1.0
        return outcome

    monkeypatch.setattr(client, "run", meanwhile)
    with pytest.raises(RuntimeError, match="'Hat' was changed meanwhile; nothing was written"):
        bake()
    assert not Record.read(figure.data.shape_keys).chains


def test_the_command(figure: bpy.types.Object, hat: bpy.types.Object, tmp_path: Path, shown: Shown) -> None:
    before, after, report = (tmp_path / name for name in ("before.blend", "after.blend", "report.json"))
    bpy.ops.wm.save_as_mainfile(filepath=str(before))
    command = ["bake", str(before), "--object", "Figure", "--object", "Hat", "--together", "--frames", "2"]
    command += ["--from", "Basis", "--to", "Lean", "--output", str(after), "--report", str(report)]
    assert main.main(command) == 0
    assert set(json.loads(report.read_text())) == {"Figure", "Hat"}
    bpy.ops.wm.open_mainfile(filepath=str(after))
    objects = [bpy.data.objects[name] for name in ("Figure", "Hat")]
    objects[0].data.shape_keys.key_blocks["Lean"].value = 0.4
    bpy.context.view_layer.update()
    assert apart(*objects, shown) < 2e-6
