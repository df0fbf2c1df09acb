# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an animator may do while a bake runs: nothing crashes, and a sentence says what became of the bake."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import open_arm
from .harness import Window, is_alive, paused

BAKE = "qc3d.bake_inbetweens"
CHANGED = "'Arm' was changed meanwhile; nothing was written."


def start(window: Window, quality: str = "normal") -> int:
    """Press the button; the process that does the work."""
    window.ask(f"arm().qc3d.quality = '{quality}'")
    window.push(BAKE)
    return window.wait_for("child()")


@pytest.fixture
def own_window(root: Path, repository: Path) -> Iterator[Window]:
    """A Blender that may end."""
    with Window(root, (800, 600)) as window:
        open_arm(window, repository)
        yield window


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("sculpt('Bend and twist')", CHANGED),
        ("arm().data.shape_keys.key_blocks['Bend and twist'].name = 'Up'", CHANGED),
        ("with inside('WINDOW'): bpy.ops.object.mode_set(mode='EDIT')", "'Arm' is being edited; go back to Object"),
        ("bpy.data.objects.remove(arm())", "'Arm' was deleted meanwhile; nothing was written."),
    ],
    ids=["sculpted", "key renamed", "edited", "deleted"],
)
def test_what_was_changed_meanwhile_is_not_written_to(window: Window, change: str, sentence: str) -> None:
    with paused(start(window)):
        window.ask(f"keys = list(bpy.data.meshes['Arm'].shape_keys.key_blocks)\n{change}\nremember('Changed')")
    window.wait_for("job() is None")
    window.wait_for(f"{sentence!r} in reports()")
    assert window.ask("len(bpy.data.meshes['Arm'].shape_keys.key_blocks)") == 4
    assert window.ask("list(bpy.data.meshes['Arm'].shape_keys.keys())") == []


def test_a_renamed_object_and_another_active_one_are_no_obstacle(window: Window) -> None:
    with paused(start(window)):
        window.ask("bpy.ops.mesh.primitive_cube_add(); bpy.data.objects['Arm'].name = 'Limb'; remember('Renamed')")
    window.wait_for("job() is None")
    assert len(window.ask("list(bpy.data.objects['Limb'].data.shape_keys.key_blocks.keys())")) == 8
    assert window.ask("bpy.context.view_layer.objects.active.name") == "Cube"


def test_an_undo_meanwhile_has_a_defined_outcome(window: Window) -> None:
    window.ask("arm().location.x = 1.0; remember('Moved')")
    with paused(start(window)):
        window.press("ctrl+z")
        window.wait_for("arm().location.x == 0.0")
    window.wait_for("job() is None")
    assert len(window.ask("names()")) == 8


def test_there_is_never_more_than_one_bake(window: Window) -> None:
    child = start(window, "finest")
    with pytest.raises(RuntimeError, match="Bake In-Betweens is running; wait for it or cancel it first"):
        window.ask("with inside('UI'): bpy.ops.qc3d.bake_inbetweens('INVOKE_DEFAULT')")
    with pytest.raises(RuntimeError, match="Bake In-Betweens is running; wait for it or cancel it first"):
        window.ask("bpy.ops.qc3d.bake_inbetweens(play_on='slider', from_key='Basis', to_key='Bend 90')")
    assert window.ask("child()") == child
    window.press("Escape")
    window.wait_for("job() is None")


def test_another_file_ends_the_bake(window: Window, repository: Path) -> None:
    child = start(window, "finest")
    before = window.ask("state()")
    open_arm(window, repository)
    assert not is_alive(child)
    assert window.ask("job()") is None
    assert window.ask("state()") == before
    start(window)
    window.wait_for("job() is None")
    assert len(window.ask("names()")) == 8


def test_disabling_the_addon_ends_the_bake(window: Window) -> None:
    child = start(window, "finest")
    before = window.ask("state()")
    window.ask("bpy.ops.preferences.addon_disable(module=ADDON)")
    assert not is_alive(child)
    assert list(window.folder.glob("qc3d-*")) == []
    window.ask("bpy.ops.preferences.addon_enable(module=ADDON)")
    assert window.ask("state()") == before
    window.open_sidebar()
    child = start(window)
    window.wait_for("job() is None")
    assert len(window.ask("names()")) == 8
    assert is_alive(child)
    window.ask("bpy.ops.preferences.addon_disable(module=ADDON)")
    assert not is_alive(child)
    window.ask("bpy.ops.preferences.addon_enable(module=ADDON)")


@pytest.mark.parametrize("has_ended", [False, True], ids=["during a bake", "after a bake"])
@pytest.mark.parametrize("how", ["quits", "is killed"])
def test_nothing_outlives_blender(own_window: Window, how: str, has_ended: bool) -> None:
    child = start(own_window, "normal" if has_ended else "finest")
    if has_ended:
        own_window.wait_for("job() is None")
        assert is_alive(child)
    if how == "quits":
        with contextlib.suppress(ConnectionError):  # Blender may answer first
            own_window.ask("bpy.ops.wm.quit_blender()")
    else:
        os.killpg(own_window.blender.pid, signal.SIGKILL)
    status = own_window.blender.wait()
    assert status == (0 if how == "quits" else -signal.SIGKILL), own_window.log
    own_window.wait_gone(child)
    assert list(own_window.folder.glob("qc3d-*")) == []


@pytest.mark.parametrize(
    ("ending", "sentence"),
    [
        (signal.SIGKILL, "The background process was ended by SIGKILL; memory may have run out"),
        (signal.SIGSEGV, "The background process was ended by SIGSEGV"),
        (signal.SIGSTOP, "The work was stopped after its time limit"),
    ],
)
def test_a_child_that_dies_or_hangs_is_said_and_changes_nothing(window: Window, ending: int, sentence: str) -> None:
    before = window.ask("state()")
    child = start(window, "finest")
    os.kill(child, ending)
    if ending == signal.SIGSTOP:
        window.ask("import sys; sys.modules[ADDON + '.blender.bake.jobs'].current()._worker._deadline = 0.0")
    window.wait_for("job() is None")
    window.wait_for(f"{sentence!r} in reports()")
    assert window.ask("state()") == before
    assert not is_alive(child)
    assert list(window.folder.glob("qc3d-*")) == []
    window.press("Escape")  # Blender shows errors in a pop-up, which covers the panel
    start(window)  # the next one works
    window.wait_for("job() is None")
    assert len(window.ask("names()")) == 8


def test_a_bake_beyond_the_memory_limit_does_not_start(window: Window) -> None:
    before = window.ask("state()")
    window.ask("bpy.context.preferences.addons[ADDON].preferences.memory_limit = 50")
    try:
        window.push(BAKE)
        window.wait_for("'MB of memory, and its limit is 50 MB.' in reports()")
    finally:
        window.ask("bpy.context.preferences.addons[ADDON].preferences.memory_limit = 0")
    assert window.ask("job()") is None
    assert window.ask("state()") == before
