# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live scrub shows every moment, and whatever ends it leaves nothing of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

import qc3d_addon
from qc3d_addon.blender import live_scrub

pytestmark = pytest.mark.usefixtures("quick_map")

SLIDER = "Basis→Lean"
Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]


@pytest.fixture
def baked(figure: bpy.types.Object) -> bpy.types.Object:
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", count=1) == {"FINISHED"}
    figure.active_shape_key_index = 1
    return figure


def drag(obj: bpy.types.Object, place: float) -> None:
    """Move the slider as the interface does: a value, then an update of the scene."""
    obj[SLIDER] = place
    obj.update_tag()
    bpy.context.view_layer.update()


def display(obj: bpy.types.Object) -> tuple[Any, ...]:
    return obj.show_only_shape_key, obj.active_shape_key.name, [key.name for key in obj.data.shape_keys.key_blocks]


def test_it_shows_what_a_dense_bake_shows(baked: bpy.types.Object, shown: Shown, shapes: ReadShapes) -> None:
    before = display(baked)
    coarse = shown(baked, **{SLIDER: 0.25})
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
    assert live_scrub.is_on(baked, SLIDER)
    assert baked.active_shape_key.name == live_scrub.KEY
    seen = {}
    for place in (0.25, 0.5, 0.75, 0.4):
        drag(baked, place)
        seen[place] = shown(baked)
    assert np.abs(seen[0.25] - coarse).max() > 1e-4  # not the straight blend of baked keys
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
    assert display(baked) == before
    bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", count=19)
    for place, found in seen.items():
        assert np.abs(found - shapes(baked)[f"{SLIDER} {round(20 * place)}/20"]).max() < 1e-4


def test_playing_the_animation_shows_it(baked: bpy.types.Object, shown: Shown) -> None:
    bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", count=1, use_keyframes=True)
    bpy.ops.qc3d.live_scrub()
    drag(baked, 0.25)
    expected = shown(baked)
    bpy.context.scene.frame_set(25)
    bpy.context.scene.frame_set(7)  # a quarter of 1 to 25
    np.testing.assert_allclose(shown(baked), expected, atol=1e-6)


def remove_add_on() -> None:
    qc3d_addon.unregister()
    qc3d_addon.register()


def pick_another_key() -> None:
    obj = bpy.context.active_object
    obj.active_shape_key_index = 2
    drag(obj, 0.6)


@pytest.mark.parametrize(
    "ending",
    [
        lambda: bpy.ops.qc3d.live_scrub(),
        lambda: bpy.ops.qc3d.live_scrub(slider=SLIDER),
        live_scrub.end,
        remove_add_on,
    ],
)
def test_it_leaves_nothing(baked: bpy.types.Object, state: State, ending: Callable[[], object]) -> None:
    baked.show_only_shape_key = True
    before, looks = state(), display(baked)
    bpy.ops.qc3d.live_scrub()
    assert display(baked) != looks
    ending()
    assert not live_scrub.is_on(baked)
    assert display(baked) == looks
    assert state() == before


def test_another_key_is_chosen(baked: bpy.types.Object) -> None:
    before = display(baked)
    bpy.ops.qc3d.live_scrub()
    pick_another_key()
    assert not live_scrub.is_on(baked)
    assert display(baked) == (before[0], "Stretch", before[2])


@pytest.mark.parametrize("operator", ["rebake", "remove", "mirror_is_refused", "to_keyframes"])
def test_other_work_ends_it(baked: bpy.types.Object, operator: str) -> None:
    bpy.ops.qc3d.live_scrub()
    if operator == "mirror_is_refused":
        with pytest.raises(RuntimeError, match="no mirror image"):
            bpy.ops.qc3d.mirror()
    else:
        assert getattr(bpy.ops.qc3d, operator)() == {"FINISHED"}
    assert not live_scrub.is_on(baked)
    assert live_scrub.KEY not in baked.data.shape_keys.key_blocks
    assert not baked.show_only_shape_key


def test_it_is_not_saved_and_goes_on_after(baked: bpy.types.Object, tmp_path: Path, shown: Shown) -> None:
    looks = display(baked)
    bpy.ops.qc3d.live_scrub()
    drag(baked, 0.3)
    expected = shown(baked)
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert live_scrub.is_on(baked, SLIDER)
    np.testing.assert_array_equal(shown(baked), expected)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    obj = bpy.data.objects["Figure"]
    assert not live_scrub.is_on(obj)
    assert display(obj) == looks
    assert not [name for name in obj.data.shape_keys.keys() if "preview" in name]  # noqa: SIM118


def test_a_file_that_was_saved_with_it_is_cleaned(baked: bpy.types.Object, tmp_path: Path) -> None:
    looks = display(baked)
    bpy.ops.qc3d.live_scrub()
    bpy.app.handlers.save_pre.remove(live_scrub._before_save)  # as after a crash: an autosave is not told
    bpy.app.handlers.save_post.remove(live_scrub._after_save)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.app.handlers.save_pre.append(live_scrub._before_save)
    bpy.app.handlers.save_post.append(live_scrub._after_save)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert display(bpy.data.objects["Figure"]) == looks


def test_the_object_is_deleted(baked: bpy.types.Object) -> None:
    bpy.ops.qc3d.live_scrub()
    bpy.data.objects.remove(baked)
    bpy.context.view_layer.update()
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.view_layer.update()
    assert live_scrub._scrub is None


def test_the_mesh_is_edited(baked: bpy.types.Object) -> None:
    bpy.ops.qc3d.live_scrub()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    drag(baked, 0.7)
    assert not live_scrub.is_on(baked)
    assert live_scrub.KEY not in baked.data.shape_keys.key_blocks


def test_keys_that_are_gone(baked: bpy.types.Object) -> None:
    baked.data.shape_keys.key_blocks["Lean"].name = "Other"
    with pytest.raises(RuntimeError, match="There is no shape key 'Lean'"):
        bpy.ops.qc3d.live_scrub()
    assert not live_scrub.is_on(baked)
