# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Before and after: the straight blend in place of in-betweens, and nothing lost by looking at it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from .conftest import add_key, coordinates

pytestmark = pytest.mark.usefixtures("quick_map")
PROPERTY = "qc3d_straight"


def shape(obj: bpy.types.Object) -> np.ndarray:
    obj.update_tag()
    obj.data.shape_keys.update_tag()
    return coordinates_of(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def coordinates_of(mesh: bpy.types.Mesh) -> np.ndarray:
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def detour(obj: bpy.types.Object, name: str) -> None:
    """Give an in-between what no straight blend has: the map of these tests moves nothing off it."""
    for point in obj.data.shape_keys.key_blocks[name].points:
        point.co.x += 0.3


def curves(obj: bpy.types.Object) -> list[Any]:
    """Everything about the drivers of the shape keys."""
    found = []
    for curve in obj.data.shape_keys.animation_data.drivers:
        points = [(*point.co, *point.handle_left, *point.handle_right) for point in curve.keyframe_points]
        found.append((curve.data_path, curve.mute, points))
    return found


def bake(obj: bpy.types.Object, *keys: str, play_on: str) -> None:
    first, *through, last = keys
    via = [{"name": name} for name in through]
    assert bpy.ops.qc3d.bake_inbetweens(
        from_key=first, via=via, to_key=last, play_on=play_on, mode="linear", count=1
    ) == {"FINISHED"}


def test_on_the_key(figure: bpy.types.Object, state: Callable[[], Any]) -> None:
    bake(figure, "Basis", "Lean", play_on="key")
    blocks = figure.data.shape_keys.key_blocks
    detour(figure, "Lean_50")
    half = (coordinates(blocks["Basis"]) + coordinates(blocks["Lean"])) / 2.0
    blocks["Lean"].value = 0.5
    baked = shape(figure)
    before, curves_before = state(), curves(figure)
    assert np.abs(baked - half).max() > 0.2
    assert bpy.ops.qc3d.straight() == {"FINISHED"}
    np.testing.assert_allclose(shape(figure), half, atol=1e-6)
    blocks["Lean"].value = 1.0
    np.testing.assert_allclose(shape(figure), coordinates(blocks["Lean"]), atol=1e-6)
    blocks["Lean"].value = 0.5
    assert bpy.ops.qc3d.straight() == {"FINISHED"}
    np.testing.assert_array_equal(shape(figure), baked)
    assert state() == before
    assert curves(figure) == curves_before


def test_on_a_slider_through_a_key(figure: bpy.types.Object, state: Callable[[], Any]) -> None:
    add_key(figure, "Up", lambda rest: rest + [0.0, 0.0, 0.5])
    bake(figure, "Lean", "Stretch", "Up", play_on="slider")
    slider = "Lean_to_Stretch_to_Up"
    blocks = figure.data.shape_keys.key_blocks
    made = [name for name in blocks.keys() if name.startswith(slider)]  # noqa: SIM118 - in the order of the file
    assert len(made) == 5
    for name in (made[1], made[3]):
        detour(figure, name)
    shown = {}
    for place in (0.0, 0.3, 0.5, 1.0):
        figure[slider] = place
        shown[place] = shape(figure)
    before, curves_before = state(), curves(figure)
    assert bpy.ops.qc3d.straight() == {"FINISHED"}
    ends = {0.0: "Lean", 0.5: "Stretch", 1.0: "Up"}
    for place, name in ends.items():
        figure[slider] = place
        np.testing.assert_allclose(shape(figure), coordinates(blocks[name]), atol=1e-6)
    figure[slider] = 0.3
    blend = 0.4 * coordinates(blocks["Lean"]) + 0.6 * coordinates(blocks["Stretch"])
    np.testing.assert_allclose(shape(figure), blend, atol=1e-5)
    assert bpy.ops.qc3d.straight() == {"FINISHED"}
    for place, there in shown.items():
        figure[slider] = place
        np.testing.assert_allclose(shape(figure), there, atol=1e-6)
    assert state() == before
    assert curves(figure) == curves_before


def test_mutes_of_the_user_stay(figure: bpy.types.Object) -> None:
    bake(figure, "Lean", "Stretch", play_on="slider")
    blocks = figure.data.shape_keys.key_blocks
    blocks["Lean_to_Stretch_50"].mute = True
    for _ in range(2):
        assert bpy.ops.qc3d.straight() == {"FINISHED"}
        assert blocks["Lean_to_Stretch_50"].mute
    bake(figure, "Basis", "Lean", play_on="key")
    driver = figure.data.shape_keys.driver_add('key_blocks["Lean_50"].mute')
    for own in (True, False):
        driver.mute = own
        assert bpy.ops.qc3d.straight() == {"FINISHED"}
        assert driver.mute  # else it would switch the in-between on again
        assert bpy.ops.qc3d.straight() == {"FINISHED"}
        assert driver.mute == own


def test_a_saved_file_is_as_without_it(figure: bpy.types.Object, tmp_path: Path) -> None:
    bake(figure, "Basis", "Lean", play_on="key")
    before = curves(figure)
    assert bpy.ops.qc3d.straight() == {"FINISHED"}
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert PROPERTY in figure.data.shape_keys  # and on again after
    assert figure.data.shape_keys.key_blocks["Lean_50"].mute
    bpy.ops.wm.open_mainfile(filepath=path)
    figure = bpy.data.objects["Figure"]
    assert PROPERTY not in figure.data.shape_keys
    assert not figure.data.shape_keys.key_blocks["Lean_50"].mute
    assert curves(figure) == before


@pytest.mark.parametrize("work", ["rebake", "remove", "mirror"])
def test_other_work_ends_it(figure: bpy.types.Object, work: str) -> None:
    bake(figure, "Basis", "Lean", play_on="key")
    assert bpy.ops.qc3d.straight() == {"FINISHED"}
    if work == "mirror":  # fails, since the names have no sides
        with pytest.raises(RuntimeError):
            bpy.ops.qc3d.mirror()
    else:
        assert getattr(bpy.ops.qc3d, work)() == {"FINISHED"}
    keys = figure.data.shape_keys
    assert PROPERTY not in keys
    if work == "remove":
        assert "Lean_50" not in keys.key_blocks
    else:
        assert not keys.key_blocks["Lean_50"].mute
        assert not any(curve.mute for curve in keys.animation_data.drivers)


def test_an_edited_driver_is_not_touched(figure: bpy.types.Object) -> None:
    bake(figure, "Lean", "Stretch", play_on="slider")
    driver = figure.data.shape_keys.animation_data.drivers.find('key_blocks["Lean_to_Stretch_100"].value')
    driver.keyframe_points[0].co.y = 0.3
    before = curves(figure)
    with pytest.raises(RuntimeError, match="The driver of 'Lean_to_Stretch_100' was edited"):
        bpy.ops.qc3d.straight()
    assert curves(figure) == before
    assert PROPERTY not in figure.data.shape_keys


@pytest.mark.parametrize("text", ["", "[]", '{"Lean": 5}', '{"Lean": [[1]]}', '{"Lean": [["a"], []]}'])
def test_damaged_remarks_do_no_harm(figure: bpy.types.Object, text: str) -> None:
    bake(figure, "Basis", "Lean", play_on="key")
    figure.data.shape_keys[PROPERTY] = text
    for muted in (True, False):
        assert bpy.ops.qc3d.straight() == {"FINISHED"}
        assert figure.data.shape_keys.key_blocks["Lean_50"].mute == muted
    assert PROPERTY not in figure.data.shape_keys
