# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live scrub shows every moment, and leaves nothing behind however it ends."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest

import qc3d_addon
from qc3d_addon.blender import live_scrub
from qc3d_addon.solver.frames.task import Outcome
from qc3d_addon.worker import client

pytestmark = pytest.mark.usefixtures("quick_map")

SLIDER = "Basis_to_Lean"
Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]


@pytest.fixture
def baked(figure: bpy.types.Object) -> bpy.types.Object:
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=1) == {"FINISHED"}
    figure.active_shape_key_index = 1
    return figure


def drag(obj: bpy.types.Object, place: float, slider: str = SLIDER) -> None:
    """Move the slider as the interface does: a value, then an update of the scene."""
    obj[slider] = place
    obj.update_tag()
    bpy.context.view_layer.update()


def looks(obj: bpy.types.Object) -> tuple[Any, ...]:
    return obj.show_only_shape_key, obj.active_shape_key.name, [key.name for key in obj.data.shape_keys.key_blocks]


def expect_nothing_left(obj: bpy.types.Object, before: tuple[Any, ...]) -> None:
    assert not live_scrub.is_on(obj)
    assert looks(obj) == before


def test_it_shows_what_a_dense_bake_shows(baked: bpy.types.Object, shown: Shown, shapes: ReadShapes) -> None:
    before = looks(baked)
    coarse = shown(baked, **{SLIDER: 0.25})
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
    assert live_scrub.is_on(baked, SLIDER)
    assert looks(baked) == (*before[:2], [*before[2], live_scrub.KEY])
    seen = {}
    for place in (0.25, 0.5, 0.75, 0.4):
        drag(baked, place)
        seen[place] = shown(baked)
    assert np.abs(seen[0.25] - coarse).max() > 1e-4  # not the straight blend of baked keys
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
    expect_nothing_left(baked, before)
    np.testing.assert_array_equal(shown(baked, **{SLIDER: 0.25}), coarse)
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=19)
    for place, found in seen.items():
        assert np.abs(found - shapes(baked)[f"{SLIDER}_{5 * round(20 * place):02d}"]).max() < 1e-4


@pytest.mark.parametrize("easing", ["linear", "ease-in-out"])
def test_a_chain_with_any_easing(figure: bpy.types.Object, shown: Shown, easing: str) -> None:
    through = {"from_key": "Basis", "via": [{"name": "Stretch"}], "to_key": "Lean", "easing": easing}
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", count=1, **through)
    bpy.ops.qc3d.live_scrub()
    name = "Basis_to_Stretch_to_Lean"
    seen = {}
    for place in (0.15, 0.4, 0.5, 0.55, 0.9):
        drag(figure, place, name)
        seen[place] = shown(figure)
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", count=9, **through)
    for place, found in seen.items():
        # The stand-in for the volume holds so little that volumes give way, with small corners in time.
        assert np.abs(found - shown(figure, **{name: place})).max() < 4e-4


def test_other_keys_and_sculpted_inbetweens_still_show(baked: bpy.types.Object, shown: Shown) -> None:
    keys = baked.data.shape_keys.key_blocks
    keys["Stretch"].value = 0.5
    keys[f"{SLIDER}_50"].points[3].co.x += 0.25
    drag(baked, 0.5)
    baked_shape = shown(baked)
    bpy.ops.qc3d.live_scrub()
    np.testing.assert_allclose(shown(baked), baked_shape, atol=1e-6)


def test_playing_the_animation_shows_it(baked: bpy.types.Object, shown: Shown) -> None:
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=1, use_keyframes=True)
    bpy.ops.qc3d.live_scrub()
    drag(baked, 0.25)
    expected = shown(baked)
    bpy.context.scene.frame_set(25)
    bpy.context.scene.frame_set(7)  # a quarter of 1 to 25
    np.testing.assert_allclose(shown(baked), expected, atol=1e-6)


def switch_the_add_on_off() -> None:
    qc3d_addon.unregister()
    qc3d_addon.register()


@pytest.mark.parametrize(
    "ending",
    [
        lambda: bpy.ops.qc3d.live_scrub(),
        lambda: bpy.ops.qc3d.live_scrub(slider=SLIDER),
        live_scrub.end,
        switch_the_add_on_off,
    ],
    ids=["button", "button of the slider", "end", "add-on off"],
)
@pytest.mark.parametrize(("active", "only"), [("Stretch", True), ("Basis", False)])
def test_it_leaves_nothing(
    baked: bpy.types.Object, state: State, ending: Callable[[], object], active: str, only: bool
) -> None:
    baked.show_only_shape_key = only
    baked.active_shape_key_index = baked.data.shape_keys.key_blocks.find(active)
    before, all_before = looks(baked), state()
    bpy.ops.qc3d.live_scrub()
    assert looks(baked) != before
    ending()
    expect_nothing_left(baked, before)
    assert state() == all_before


@pytest.mark.parametrize("operator", ["rebake", "remove", "to_keyframes", "absolute_keys"])
def test_other_work_ends_it(baked: bpy.types.Object, operator: str) -> None:
    bpy.ops.qc3d.live_scrub()
    assert getattr(bpy.ops.qc3d, operator)() == {"FINISHED"}
    assert not live_scrub.is_on(baked)
    assert not any(live_scrub.KEY in keys.key_blocks for keys in bpy.data.shape_keys)


def test_another_slider_takes_over(baked: bpy.types.Object) -> None:
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Stretch", count=1)
    bpy.ops.qc3d.live_scrub(slider=SLIDER)
    bpy.ops.qc3d.live_scrub(slider="Basis_to_Stretch")
    assert live_scrub.is_on(baked, "Basis_to_Stretch")
    assert not live_scrub.is_on(baked, SLIDER)


def test_its_key_or_slider_is_deleted(baked: bpy.types.Object) -> None:
    before = looks(baked)
    bpy.ops.qc3d.live_scrub()
    baked.shape_key_remove(baked.data.shape_keys.key_blocks[live_scrub.KEY])
    baked.active_shape_key_index = 1
    drag(baked, 0.3)
    expect_nothing_left(baked, before)
    bpy.ops.qc3d.live_scrub()
    del baked[SLIDER]
    bpy.context.view_layer.update()
    baked.update_tag()
    bpy.context.view_layer.update()
    expect_nothing_left(baked, before)


def test_it_is_not_saved_and_goes_on_after(baked: bpy.types.Object, tmp_path: Path, shown: Shown) -> None:
    before = looks(baked)
    bpy.ops.qc3d.live_scrub()
    drag(baked, 0.3)
    expected = shown(baked)
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert live_scrub.is_on(baked, SLIDER)
    np.testing.assert_array_equal(shown(baked), expected)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    expect_nothing_left(bpy.data.objects["Figure"], before)


def test_it_goes_on_where_saving_fails(baked: bpy.types.Object, tmp_path: Path) -> None:
    bpy.ops.qc3d.live_scrub()
    with pytest.raises(RuntimeError):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "no folder" / "saved.blend"))
    assert live_scrub.is_on(baked, SLIDER)
    assert live_scrub.KEY in baked.data.shape_keys.key_blocks


def test_it_goes_on_where_loading_fails(baked: bpy.types.Object, tmp_path: Path) -> None:
    bpy.ops.qc3d.live_scrub()
    with pytest.raises(RuntimeError):
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "none.blend"))
    assert live_scrub.is_on(baked, SLIDER)
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
    assert live_scrub.KEY not in baked.data.shape_keys.key_blocks


def save_untold(path: Path) -> None:
    """Save as an autosave does, which tells no add-on."""
    bpy.app.handlers.save_pre.remove(live_scrub._before_save)
    bpy.app.handlers.save_post.remove(live_scrub._after_save)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.app.handlers.save_pre.append(live_scrub._before_save)
    bpy.app.handlers.save_post.append(live_scrub._after_save)


def test_a_recovered_file_is_cleaned(baked: bpy.types.Object, tmp_path: Path) -> None:
    before = looks(baked)
    bpy.ops.qc3d.live_scrub()
    save_untold(tmp_path / "saved.blend")
    with bpy.data.libraries.load(str(tmp_path / "saved.blend")) as (there, here):
        here.meshes = there.meshes
    assert live_scrub.KEY in here.meshes[0].shape_keys.key_blocks
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    expect_nothing_left(bpy.data.objects["Figure"], before)


def test_the_object_is_deleted_and_its_mesh_is_kept(baked: bpy.types.Object) -> None:
    mesh = baked.data
    mesh.use_fake_user = True
    bpy.ops.qc3d.live_scrub()
    bpy.data.objects.remove(baked)
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.view_layer.update()
    assert live_scrub._scrub is None
    assert live_scrub.KEY not in mesh.shape_keys.key_blocks
    assert [obj.name for obj in bpy.data.objects] == ["Cube"]
    assert mesh.users == 1


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "WEIGHT_PAINT"])
def test_leaving_object_mode_ends_it(baked: bpy.types.Object, mode: str) -> None:
    before = looks(baked)
    bpy.ops.qc3d.live_scrub()
    bpy.ops.object.mode_set(mode=mode)
    drag(baked, 0.6)
    bpy.ops.object.mode_set(mode="OBJECT")
    drag(baked, 0.7)
    expect_nothing_left(baked, before)


def test_the_mesh_is_cut_in_edit_mode(baked: bpy.types.Object) -> None:
    before = looks(baked)
    bpy.ops.qc3d.live_scrub()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    drag(baked, 0.7)
    expect_nothing_left(baked, before)


@pytest.mark.parametrize("active", ["Basis", "Lean"])
def test_saving_in_edit_mode_takes_it_away_and_keeps_the_edit(
    baked: bpy.types.Object, tmp_path: Path, shapes: ReadShapes, active: str
) -> None:
    baked.active_shape_key_index = baked.data.shape_keys.key_blocks.find(active)
    before, rest = looks(baked), shapes(baked)
    bpy.ops.qc3d.live_scrub()
    bpy.ops.object.mode_set(mode="EDIT")
    drag(baked, 0.6)
    mesh = bmesh.from_edit_mesh(baked.data)
    mesh.verts.ensure_lookup_table()
    mesh.verts[5].co.z += 2.0
    mesh.verts[5].select = True
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert baked.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    for obj in (baked, None):
        if obj is None:
            bpy.ops.wm.open_mainfile(filepath=str(path))
            bpy.ops.object.mode_set(mode="OBJECT")
            obj = bpy.data.objects["Figure"]
        expect_nothing_left(obj, before)
        moved = shapes(obj)[active] - rest[active]
        np.testing.assert_array_equal(np.flatnonzero(moved.any(axis=1)), [5])


def test_it_is_not_rendered(baked: bpy.types.Object, tmp_path: Path) -> None:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.collection.objects.link(camera)
    scene = bpy.context.scene
    scene.camera, scene.render.engine, scene.cycles.samples = camera, "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.filepath = str(tmp_path / "image.png")
    bpy.ops.qc3d.live_scrub()
    key = baked.data.shape_keys.key_blocks[live_scrub.KEY]
    muted = []
    bpy.app.handlers.render_pre.append(lambda *_: muted.append(key.mute))
    bpy.ops.render.render()
    assert muted == [True]
    assert not key.mute


def test_keys_that_are_gone(baked: bpy.types.Object) -> None:
    key = baked.data.shape_keys.key_blocks["Lean"]
    key.name, key.points[0].co.x = "Other", 7.0  # another name alone would be followed
    with pytest.raises(RuntimeError, match="Shape key 'Lean' was renamed or deleted"):
        bpy.ops.qc3d.live_scrub()
    assert not live_scrub.is_on(baked)


def test_an_object_that_was_changed_meanwhile_is_left_as_it_is(
    baked: bpy.types.Object, state: State, monkeypatch: pytest.MonkeyPatch
) -> None:
    carry_out = client.run

    def run(*arguments: object) -> Outcome:
        outcome = carry_out(*arguments)
        baked.data.shape_keys.key_blocks["Lean"].points[0].co.x += 1.0
        return outcome

    monkeypatch.setattr(client, "run", run)
    with pytest.raises(RuntimeError, match="'Figure' was changed meanwhile"):
        bpy.ops.qc3d.live_scrub()
    assert live_scrub.KEY not in baked.data.shape_keys.key_blocks
