# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""*Re-Bake*: the same options again after sculpting, with everything that depends on the slider kept."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender import compat
from qc3d_addon.blender.store.records import PROPERTY, Record

pytestmark = pytest.mark.usefixtures("quick_map")

SLIDER = "Basis_to_Lean"
State = Callable[[], dict[str, Any]]
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]


@pytest.fixture
def baked(figure: bpy.types.Object) -> bpy.types.Object:
    choices = {"mode": "linear", "count": 2, "easing": "ease-in", "seed": 7, "use_keyframes": True}
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", **choices) == {"FINISHED"}
    return figure


@pytest.mark.parametrize("key", ["Basis", "Lean"])
def test_everything_but_the_shapes_is_kept(baked: bpy.types.Object, shapes: ReadShapes, key: str) -> None:
    lamp = bpy.data.objects.new("Lamp", None)
    bpy.context.collection.objects.link(lamp)
    variable = lamp.driver_add("location", 0).driver.variables.new()
    variable.targets[0].id = baked
    variable.targets[0].data_path = f'["{SLIDER}"]'
    baked.data.shape_keys.key_blocks["Basis_to_Lean_33"].name = "Renamed"
    baked.data.shape_keys.key_blocks["Basis_to_Lean_67"].slider_max = 0.8
    names = list(shapes(baked))
    curve = compat.find_fcurve(baked, f'["{SLIDER}"]')
    assert curve is not None
    points = [point.co[:] for point in curve.keyframe_points]
    animation = baked.animation_data
    slot = (animation.action, getattr(animation, "action_slot", None))
    before = shapes(baked)
    for point in baked.data.shape_keys.key_blocks[key].points:
        point.co.y += 0.3 * point.co.z
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    after = shapes(baked)
    assert list(after) == names
    assert np.abs(after["Renamed"] - before["Renamed"]).max() > 0.01
    np.testing.assert_array_equal(after["Basis_to_Lean_100"], after["Lean"])
    assert baked.data.shape_keys.key_blocks["Basis_to_Lean_67"].slider_max == np.float32(0.8)
    curve = compat.find_fcurve(baked, f'["{SLIDER}"]')
    assert curve is not None
    assert [point.co[:] for point in curve.keyframe_points] == points
    assert (animation.action, getattr(animation, "action_slot", None)) == slot
    assert baked.data.shape_keys.animation_data.action is None
    assert lamp.animation_data.drivers[0].driver.variables[0].targets[0].id == baked


def test_the_choices_are_those_of_the_bake_and_not_of_the_panel(baked: bpy.types.Object, quick_map: list[Any]) -> None:
    baked.qc3d.count, baked.qc3d.easing = 9, "linear"
    baked.data.shape_keys.key_blocks["Lean"].points[0].co.x += 0.1
    before = Record.read(baked.data.shape_keys).chains[0].request
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    assert Record.read(baked.data.shape_keys).chains[0].request == before
    assert quick_map[-1].seed == 7
    assert len(Record.read(baked.data.shape_keys).chains[0].keys) == 3


def test_the_one_that_is_named_or_the_newest(baked: bpy.types.Object, shapes: ReadShapes) -> None:
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Stretch", mode="linear", count=1)
    before = shapes(baked)
    for name in ("Lean", "Stretch"):
        baked.data.shape_keys.key_blocks[name].points[0].co.x += 0.5
    bpy.ops.qc3d.rebake(slider=SLIDER)
    middle = shapes(baked)
    assert np.abs(middle["Basis_to_Lean_100"] - before["Basis_to_Lean_100"]).max() > 0.4
    np.testing.assert_array_equal(middle["Basis_to_Stretch_100"], before["Basis_to_Stretch_100"])
    bpy.ops.qc3d.rebake(slider="Basis_to_Stretch")
    assert np.abs(shapes(baked)["Basis_to_Stretch_100"] - before["Basis_to_Stretch_100"]).max() > 0.4


def test_a_record_of_an_older_version(baked: bpy.types.Object, state: State) -> None:
    keys = baked.data.shape_keys
    stored = json.loads(keys[PROPERTY])
    for chain in stored["chains"]:
        del chain["request"], chain["result"]
    keys[PROPERTY] = json.dumps(stored)
    before = state()
    with pytest.raises(RuntimeError, match="are unknown; bake anew"):
        bpy.ops.qc3d.rebake()
    assert state() == before
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key="Lean", mode="linear", count=2
    ) == {"FINISHED"}
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}


def test_a_key_that_was_deleted(baked: bpy.types.Object, state: State) -> None:
    key = baked.data.shape_keys.key_blocks["Lean"]
    key.name, key.points[0].co.x = "Other", 7.0  # another name alone would be followed
    before = state()
    for again in (bpy.ops.qc3d.rebake, bpy.ops.qc3d.live_scrub):
        with pytest.raises(RuntimeError, match="Shape key 'Lean' was renamed or deleted; restore its name"):
            again()
    assert state() == before
    baked.data.shape_keys.key_blocks["Other"].name = "Lean"
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}


@pytest.mark.parametrize("key", ["Basis", "Lean", "Stretch"])
def test_a_chain_again_after_any_of_its_keys_was_sculpted(
    figure: bpy.types.Object, shapes: ReadShapes, quick_map: list[Any], key: str
) -> None:
    way = {"from_key": "Basis", "via": [{"name": "Lean"}], "to_key": "Stretch"}
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", **way, mode="linear", count=1, use_keyframes=True)
    slider = "Basis_to_Lean_to_Stretch"
    curve = compat.find_fcurve(figure, f'["{slider}"]')
    assert curve is not None
    curve.keyframe_points[1].co.x = 40.0
    names, maps = list(shapes(figure)), len(quick_map)
    for point in figure.data.shape_keys.key_blocks[key].points:
        point.co.y += 0.3 * point.co.z
    assert bpy.ops.qc3d.rebake(slider=slider) == {"FINISHED"}
    after = shapes(figure)
    assert list(after) == names
    for step, own in ((2, "Lean"), (4, "Stretch")):
        np.testing.assert_array_equal(after[f"{slider}_{25 * step}"], after[own])
    assert np.abs(after[f"{slider}_25"] - (after["Basis"] + after["Lean"]) / 2).max() < 1e-6
    assert np.abs(after[f"{slider}_75"] - (after["Lean"] + after["Stretch"]) / 2).max() < 1e-6
    assert len(quick_map) - maps == (2 if key == "Lean" else 1)  # only pairs with a changed key
    curve = compat.find_fcurve(figure, f'["{slider}"]')
    assert curve is not None
    assert curve.keyframe_points[1].co.x == 40.0
