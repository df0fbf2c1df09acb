# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for all tests in Blender: an empty scene with the add-on registered, a small figure with shape keys, and a
fast map.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module is not installed")

import qc3d_addon  # noqa: E402
from qc3d_addon.blender.bake import jobs  # noqa: E402
from qc3d_addon.blender.keys import drivers  # noqa: E402
from qc3d_addon.blender.keys.control import slider_path  # noqa: E402
from qc3d_addon.blender.store import records  # noqa: E402
from qc3d_addon.solver.fit import volume  # noqa: E402
from qc3d_addon.solver.frames.many import Run  # noqa: E402
from qc3d_addon.solver.frames.task import Task, carry_out  # noqa: E402
from qc3d_addon.solver.meshing.cube import FilledCube  # noqa: E402
from qc3d_addon.solver.settings import FitOptions  # noqa: E402
from qc3d_addon.solver.support.progress import finish  # noqa: E402
from qc3d_addon.solver.tets.mesh import TetMesh  # noqa: E402
from qc3d_addon.worker import client  # noqa: E402

Shapes = dict[str, np.ndarray]


@pytest.fixture(autouse=True)
def addon() -> Iterator[None]:
    """The add-on in an empty scene; taken back even where the test fails."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    qc3d_addon.register()
    yield
    qc3d_addon.unregister()


@pytest.fixture
def quick_map(monkeypatch: pytest.MonkeyPatch) -> list[FitOptions]:
    """Fill the cube with six tetrahedra only; the options of each call.

    Their corners are the cube's own, which no map moves: the rest of the solver runs as it is, in milliseconds, and its
    mode ``linear`` gives the straight blend.
    """
    calls = []

    def fill_cube(points: np.ndarray, faces: np.ndarray, options: FitOptions, *_: object, **__: object) -> FilledCube:
        calls.append(options)
        return six_tetrahedra()

    monkeypatch.setattr(volume, "fill_cube", fill_cube)
    _work_here(monkeypatch)
    return calls


def six_tetrahedra() -> FilledCube:
    """The unit cube of six tetrahedra: one for each way round from corner 0 to corner 7 along three edges (Kuhn)."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
    tets = np.array([[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]])
    return FilledCube(TetMesh(corners, tets), "six", ())


@pytest.fixture
def work_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in this process and not in a child process."""
    _work_here(monkeypatch)


def _work_here(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(job: Task | Run, on_progress: Callable[..., None] | None, *_: object) -> object:
        return job.outcomes(on_progress) if isinstance(job, Run) else finish(carry_out(job), on_progress)

    monkeypatch.setattr(client, "run", run)
    monkeypatch.setattr(jobs, "prepare", lambda: None)


@pytest.fixture
def figure() -> bpy.types.Object:
    """The active object "Figure": a sphere with the shape keys Basis, Lean and Stretch, half of it left in place."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    obj = bpy.context.active_object
    obj.name = obj.data.name = "Figure"
    add_key(obj, "Basis", lambda rest: rest)
    add_key(obj, "Lean", lambda rest: rest + np.maximum(rest[:, 2:], 0.0) ** 2 * [0.4, 0.1, -0.1])
    add_key(obj, "Stretch", lambda rest: rest + np.maximum(rest[:, 2:], 0.0) ** 2 * [0.0, -0.2, 0.7])
    return obj


def add_key(obj: bpy.types.Object, name: str, shape: Callable[[np.ndarray], np.ndarray]) -> bpy.types.ShapeKey:
    rest = np.empty(3 * len(obj.data.vertices), dtype=np.float32)
    obj.data.vertices.foreach_get("co", rest)
    key = obj.shape_key_add(name=name, from_mix=False)
    key.value = 0.0
    key.points.foreach_set("co", shape(rest.reshape(-1, 3)).astype(np.float32).ravel())
    return key


def coordinates(key: bpy.types.ShapeKey) -> np.ndarray:
    values = np.empty(3 * len(key.points), dtype=np.float32)
    key.points.foreach_get("co", values)
    return values.reshape(-1, 3)


@pytest.fixture
def shapes() -> Callable[[bpy.types.Object], Shapes]:
    """Gives the positions of all shape keys of an object by name."""
    return lambda obj: {key.name: coordinates(key) for key in obj.data.shape_keys.key_blocks}


@pytest.fixture
def shown() -> Callable[..., np.ndarray]:
    """Gives the positions that an object shows, after setting custom properties of it."""

    def evaluate(obj: bpy.types.Object, **sliders: float) -> np.ndarray:
        for name, value in sliders.items():
            obj[name] = value
        obj.update_tag()
        mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        mesh.vertices.foreach_get("co", values)
        return values.reshape(-1, 3)

    return evaluate


@pytest.fixture
def state() -> Callable[[], dict[str, Any]]:
    """Describes everything in the file that a bake may touch, so that two descriptions can be compared."""

    def describe() -> dict[str, object]:
        return {
            "objects": {obj.name: _describe_object(obj) for obj in bpy.data.objects},
            "keys": {keys.name: _describe_keys(keys) for keys in bpy.data.shape_keys},
            "actions": {action.name: _describe_action(action) for action in bpy.data.actions},
            "meshes": {mesh.name: _describe_mesh(mesh) for mesh in bpy.data.meshes},
            "nodes": {tree.name: (tree.users, len(tree.nodes)) for tree in bpy.data.node_groups},
            "collections": [(group.name, group.objects.keys()) for group in bpy.data.collections],
            "frame": bpy.context.scene.frame_current_final,
            "selected": sorted(obj.name for obj in bpy.context.selected_objects),
            "active": getattr(bpy.context.view_layer.objects.active, "name", None),
        }

    return describe


def _describe_mesh(mesh: bpy.types.Mesh) -> list[Any]:
    found: list[Any] = [len(mesh.vertices), mesh.color_attributes.active_color_name if mesh.color_attributes else ""]
    for attribute in mesh.attributes:
        values = np.zeros(len(attribute.data), dtype=np.float32)
        if attribute.data_type == 'FLOAT':
            attribute.data.foreach_get("value", values)
        found.append((attribute.name, attribute.data_type, values.tobytes()))
    return found


def _describe_action(action: bpy.types.Action) -> list[Any]:
    slots = [slot.identifier for slot in getattr(action, "slots", ())]
    points = [(curve.data_path, [point.co[:] for point in curve.keyframe_points]) for curve in _curves(action)]
    return [action.users, slots, points]


def _curves(action: bpy.types.Action) -> list[bpy.types.FCurve]:
    if hasattr(action, "layers"):
        return [c for layer in action.layers for s in layer.strips for bag in s.channelbags for c in bag.fcurves]
    return list(action.fcurves)


def _describe_object(obj: bpy.types.Object) -> dict[str, Any]:
    return {
        "properties": {name: value for name, value in obj.items() if isinstance(value, (int, float, str, bytes))},
        "names": [name for name in obj.keys() if name != "qc3d"],  # noqa: SIM118 - of the panel's choices in 4.5
        "modifiers": [(modifier.name, modifier.type) for modifier in obj.modifiers],
        "mode": obj.mode,
        "active key": obj.active_shape_key_index,
        "action": obj.animation_data and obj.animation_data.action and obj.animation_data.action.name,
    }


def _without_seconds(properties: dict[str, Any]) -> dict[str, Any]:
    """The record without how long a bake took, which differs each time."""
    if records.PROPERTY in properties:
        try:
            record = json.loads(properties[records.PROPERTY])
            for chain in record["chains"]:
                (chain["result"] or {}).pop("seconds", None)
        except (ValueError, KeyError, TypeError):
            return properties  # not what a bake writes
        properties[records.PROPERTY] = record
    return properties


def _describe_keys(keys: bpy.types.Key) -> dict[str, Any]:
    drivers = keys.animation_data.drivers if keys.animation_data else []
    return {
        "properties": _without_seconds(dict(keys.items())),
        "relative": keys.use_relative,
        "blocks": [
            (key.name, key.value, key.mute, key.lock_shape, key.relative_key.name, coordinates(key).tobytes())
            for key in keys.key_blocks
        ],
        "drivers": [(curve.data_path, curve.driver.expression) for curve in drivers],
    }


@pytest.fixture
def slider_drivers() -> Callable[[bpy.types.Object, str], dict[str, bpy.types.Driver]]:
    """Gives the drivers of an object's shape keys that read a slider."""


    def found(obj: bpy.types.Object, name: str) -> dict[str, bpy.types.Driver]:
        curves = drivers.driven_by(obj.data.shape_keys, slider_path(name))
        return {path: curve.driver for path, curve in curves.items()}

    return found


@pytest.fixture
def record() -> Callable[[bpy.types.Object], records.Record]:
    """Gives what is remembered about an object's shape keys."""
    return lambda obj: records.Record.read(obj.data.shape_keys)
