# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel as an animator uses it: Esc, the list of bakes, Pose Mode, before and after, the search."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from .harness import Window, paused

BAKE = "qc3d.bake_inbetweens"
RIG = """
rig = bpy.data.objects.new('Rig', bpy.data.armatures.new('Rig'))
bpy.context.scene.collection.objects.link(rig)
arm().modifiers.new('Armature', 'ARMATURE').object = rig
bpy.context.view_layer.objects.active = rig
with inside('WINDOW'):
    bpy.ops.object.mode_set(mode='EDIT')
    rig.data.edit_bones.new('control').tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode='POSE')
remember('Posed')
"""


def bake_on_keys(window: Window, *names: str) -> None:
    window.ask("arm().qc3d.play_on = 'auto'")
    for name in names:
        window.ask(f"bpy.ops.{BAKE}(from_key='Basis', to_key={name!r}, count=2)")
    window.ask("remember('Baked')")


@pytest.mark.parametrize("place", ["sidebar", "status bar"])
def test_escape_is_for_the_progress_only_with_the_mouse_over_it(window: Window, place: str) -> None:
    window.ask("arm().qc3d.quality = 'finest'")
    window.push(BAKE)
    with paused(window.wait_for("child()")):
        window.move(200, 300)
        time.sleep(0.5)
        window.press("Escape")  # over the 3D view it belongs to other tools
        time.sleep(0.5)
        assert window.ask("job() is not None")
        with_playback = "bpy.context.window_manager.windows[0].screen.is_animation_playing"
        window.press("space")
        window.wait_for(with_playback)
        window.press("Escape")
        window.wait_for(f"not {with_playback}")
        assert window.ask("job() is not None")
        if place == "sidebar":
            window.hover_sidebar()
        else:
            window.move(300, window.size[1] - 8)
            time.sleep(0.3)
        window.press("Escape")
        window.wait_for("job() is None")
    window.wait_for("'Bake In-Betweens was canceled; nothing was changed.' in reports()")


def test_the_list_and_before_and_after(window: Window, tmp_path: Path) -> None:
    bake_on_keys(window, "Bend 90", "Twist 120", "Bend and twist")
    assert window.ask("arm().qc3d.row") == 0
    window.find("Bend 90")
    window.shoot(tmp_path / "list.png")
    before = window.ask("state()")
    window.push("qc3d.straight")
    window.wait_for("arm().data.shape_keys.key_blocks['Bend and twist_33'].mute")
    window.shoot(tmp_path / "before.png")
    window.press("ctrl+z")
    window.wait_for("not arm().data.shape_keys.key_blocks['Bend and twist_33'].mute")
    assert window.ask("state()") == before


def test_sliders_and_before_and_after_in_pose_mode(window: Window, tmp_path: Path) -> None:
    bake_on_keys(window, "Bend and twist")
    window.ask(RIG)
    _, y = window.find("value")
    window.shoot(tmp_path / "pose.png")
    left, width = window.ask("r = region('UI'); [r.x, r.width]")
    window.click(left + round(0.877 * (width - 16)), y)  # the button at the end of the row
    window.wait_for("arm().data.shape_keys.key_blocks['Bend and twist_33'].mute")
    assert window.ask("bpy.context.view_layer.objects.active.mode") == "POSE"


@pytest.mark.parametrize("words", ["in-between", "breakdown bake", "tween"])
def test_search_finds_it(window: Window, words: str) -> None:
    window.ask("arm().qc3d.quality = 'finest'")
    window.move(200, 300)
    time.sleep(0.3)
    window.ask("with inside('WINDOW'): bpy.ops.wm.search_menu('INVOKE_DEFAULT')")
    time.sleep(1.0)
    window.type(words)
    time.sleep(1.0)
    window.press("Return")
    window.wait_for("job() is not None")
    window.hover_sidebar()
    window.press("Escape")
    window.wait_for("job() is None")
