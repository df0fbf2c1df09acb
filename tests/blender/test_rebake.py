# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking again replaces what the earlier bake made, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("quick_map")

Shapes = dict[str, np.ndarray]
ReadShapes = Callable[[bpy.types.Object], Shapes]
Shown = Callable[..., np.ndarray]
SLIDER = "Basis_to_Lean"


def bake(to_key: str = "Lean", **choices: object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key=to_key, mode='linear', **choices
    ) == {'FINISHED'}


def delete(obj: bpy.types.Object, name: str) -> None:
    """Delete a key as an animator does; ``shape_key_remove`` alone crashes Blender where the key is driven."""
    active = obj.active_shape_key_index
    obj.active_shape_key_index = obj.data.shape_keys.key_blocks.find(name)
    bpy.ops.object.shape_key_remove()
    obj.active_shape_key_index = active


def sculpt(obj: bpy.types.Object, name: str) -> np.ndarray:
    """Move one vertex of a key; all its positions."""
    key = obj.data.shape_keys.key_blocks[name]
    key.points[0].co.x += 0.5
    values = np.empty(3 * len(key.points), dtype=np.float32)
    key.points.foreach_get("co", values)
    return values.reshape(-1, 3)


def test_the_same_bake_again_changes_nothing(figure: bpy.types.Object, state: Callable[[], dict[str, Any]]) -> None:
    bake(use_keyframes=True)
    before = state()
    bake(use_keyframes=True)
    assert state() == before


def test_a_sculpted_key_gives_new_shapes_in_the_same_keys(
    figure: bpy.types.Object, shapes: ReadShapes, shown: Shown, quick_map: list[Any]
) -> None:
    bake(count=1)
    figure.shape_key_add(name="Later", from_mix=False)
    figure[SLIDER] = 0.75
    sculpted = sculpt(figure, "Lean")
    bake(count=1)
    got = shapes(figure)
    assert list(got) == ["Basis", "Lean", "Stretch", "Basis_to_Lean_50", "Basis_to_Lean_100", "Later"]
    assert np.array_equal(got["Basis_to_Lean_100"], sculpted)
    assert np.abs(got["Basis_to_Lean_50"] - (got["Basis"] + sculpted) / 2).max() < 1e-6
    assert figure[SLIDER] == 0.75
    assert len(quick_map) == 2
    # Blender draws the new shape without being told twice.
    assert np.abs(shown(figure, **{SLIDER: 1.0}) - sculpted).max() < 1e-6


def test_another_number_of_in_betweens_replaces_the_keys_and_keeps_the_slider(
    figure: bpy.types.Object,
    shapes: ReadShapes,
    shown: Shown,
    quick_map: list[Any],
    slider_drivers: Callable[..., dict[str, Any]],
) -> None:
    bake(count=3)
    bake("Stretch", count=1)
    own = figure.shape_key_add(name="Basis_to_Lean_225", from_mix=False)  # looks like ours, is the animator's
    own.value = 0.0
    figure[SLIDER] = 0.5
    figure.active_shape_key_index = list(shapes(figure)).index("Basis_to_Lean_225")
    bake(count=1)
    got = shapes(figure)
    assert list(got) == [
        "Basis",
        "Lean",
        "Stretch",
        "Basis_to_Lean_50",  # where there were some before
        "Basis_to_Lean_100",
        "Basis_to_Stretch_50",
        "Basis_to_Stretch_100",
        "Basis_to_Lean_225",
    ]
    assert figure.active_shape_key.name == "Basis_to_Lean_225"
    assert figure[SLIDER] == 0.5
    assert len(slider_drivers(figure, SLIDER)) == 2
    assert len(figure.data.shape_keys.animation_data.drivers) == 4
    assert len(quick_map) == 2  # one map per pair: the number of in-betweens does not change it
    assert np.abs(shown(figure, **{SLIDER: 0.5}) - got["Basis_to_Lean_50"]).max() < 1e-6


def test_a_generated_key_that_was_renamed_is_still_replaced(figure: bpy.types.Object, shapes: ReadShapes) -> None:
    bake(count=1)
    figure.data.shape_keys.key_blocks["Basis_to_Lean_50"].name = "Breakdown"
    sculpted = sculpt(figure, "Lean")
    bake(count=1)
    got = shapes(figure)
    assert list(got) == ["Basis", "Lean", "Stretch", "Breakdown", "Basis_to_Lean_100"]
    assert np.abs(got["Breakdown"] - (got["Basis"] + sculpted) / 2).max() < 1e-6
    bake(count=2)
    assert list(shapes(figure))[3:] == ["Basis_to_Lean_100", "Basis_to_Lean_33", "Basis_to_Lean_67"]


def test_a_generated_key_that_was_deleted_comes_back(figure: bpy.types.Object, shapes: ReadShapes) -> None:
    bake(count=2)
    delete(figure, "Basis_to_Lean_33")
    bake(count=2)
    assert sorted(shapes(figure)) == sorted(
        ["Basis", "Lean", "Stretch", "Basis_to_Lean_33", "Basis_to_Lean_67", "Basis_to_Lean_100"]
    )


def test_a_key_of_the_animator_under_a_deleted_keys_name_is_not_replaced(
    figure: bpy.types.Object, shapes: ReadShapes
) -> None:
    bake(count=1)
    delete(figure, "Basis_to_Lean_50")
    figure.shape_key_add(name="Basis_to_Lean_50", from_mix=False).value = 0.0
    bake(count=1)
    got = shapes(figure)
    assert np.array_equal(got["Basis_to_Lean_50"], got["Basis"])
    assert "Basis_to_Lean_50.001" in got


def test_the_animators_key_with_a_copied_driver_is_not_replaced(figure: bpy.types.Object, shapes: ReadShapes) -> None:
    bake(count=1)
    keys = figure.data.shape_keys
    source = next(c for c in keys.animation_data.drivers if c.data_path.endswith('_50"].value'))
    keys.animation_data.drivers.from_existing(src_driver=source).data_path = 'key_blocks["Stretch"].value'
    before = shapes(figure)["Stretch"]
    bake(count=2)
    assert np.array_equal(shapes(figure)["Stretch"], before)


def test_objects_that_share_a_mesh_share_the_first_ones_slider(figure: bpy.types.Object, shapes: ReadShapes) -> None:
    bake(count=1)
    twin = bpy.data.objects.new("Twin", figure.data)
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.objects.active = twin
    bake(count=2)
    assert SLIDER not in twin
    drivers = figure.data.shape_keys.animation_data.drivers
    assert {curve.driver.variables[0].targets[0].id for curve in drivers} == {figure}


def test_a_slider_whose_object_was_deleted_moves_to_the_active_object(
    figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
) -> None:
    twin = bpy.data.objects.new("Twin", figure.data)
    bpy.context.scene.collection.objects.link(twin)
    bake(count=1)
    bpy.data.objects.remove(figure)
    bpy.context.view_layer.objects.active = twin
    bake(count=1)
    got = shapes(twin)
    assert np.abs(shown(twin, **{SLIDER: 1.0}) - got["Lean"]).max() < 1e-6


def test_a_copied_figure_is_baked_on_its_own(figure: bpy.types.Object, shapes: ReadShapes) -> None:
    bake(count=1)
    bpy.ops.object.duplicate()
    copy = bpy.context.active_object
    assert copy.data != figure.data
    before = shapes(figure)
    bake(count=3)
    after = shapes(figure)
    assert list(before) == list(after)
    assert len([name for name in shapes(copy) if "_to_" in name]) == 4
    owners = {c.driver.variables[0].targets[0].id for c in copy.data.shape_keys.animation_data.drivers}
    assert owners == {copy}
