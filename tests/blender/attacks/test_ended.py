# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender is killed during a bake, or the add-on is disabled: no process or file is left, and nothing is written."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

import qc3d_addon
from qc3d_addon.blender import live_scrub
from qc3d_addon.blender.bake import jobs
from qc3d_addon.blender.bake.plan import plan_bake
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.solver.files.private_folders import remove_abandoned
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.worker.client import Limits

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")

State = Callable[[], dict[str, Any]]
PATIENCE = 60.0

BAKE = """
import sys
import bpy
import qc3d_addon
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
qc3d_addon.register()
bpy.context.view_layer.objects.active = bpy.data.objects["Figure"]
choices = {"count": 400, "quality": "finest", "engine": "delaunay"} if sys.argv[2] == "slow" else {"mode": "straight"}
print(bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", **choices))
bpy.ops.wm.save_mainfile()
qc3d_addon.unregister()  # the Python module of Blender 4.5 may crash at its end where classes are registered
"""


@pytest.fixture
def temporary(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def children_of(pid: int) -> list[int]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            found.append(int(stat.parent.name))
    return found


def wait_for(done: Callable[[], Any], what: str) -> Any:  # noqa: ANN401 - whatever is waited for
    end = time.monotonic() + PATIENCE
    while not (found := done()):
        assert time.monotonic() < end, what
        time.sleep(0.02)
    return found


def is_gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def left_in(folder: Path) -> list[Path]:
    """The files of a bake that are there, whatever the folder for them is called."""
    return [path for path in folder.rglob("*") if path.suffix in (".json", ".npz", ".npy", ".map", ".txt")]


def blender(path: Path, how: str, temporary: Path, repository: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", BAKE, str(path), how],
        cwd=repository,
        env={**os.environ, "TMPDIR": str(temporary)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


@pytest.mark.parametrize("ending", ["SIGKILL", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGSEGV"])
def test_blender_is_ended_while_it_bakes(
    figure: bpy.types.Object, temporary: Path, tmp_path: Path, repository: Path, ending: str
) -> None:
    path = tmp_path / "figure.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    before = hashlib.sha256(path.read_bytes()).hexdigest()
    with blender(path, "slow", temporary, repository) as process:
        (child,) = wait_for(lambda: children_of(process.pid), "the child process")
        wait_for(lambda: left_in(temporary), "the task in its folder")
        process.send_signal(getattr(signal, ending))
    assert process.returncode != 0
    wait_for(lambda: is_gone(child), "the end of the child process")
    # Killed while it wrote a file, it may leave that one: the next bake removes it, as it removes the folder of both.
    remove_abandoned(temporary)
    assert left_in(temporary) == []
    assert hashlib.sha256(path.read_bytes()).hexdigest() == before
    assert [other for other in tmp_path.iterdir() if other != temporary] == [path]
    if ending != "SIGKILL":
        return
    # The next one bakes as if nothing had been.
    with blender(path, "quick", temporary, repository) as process:
        assert process.wait() == 0
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert len(bpy.data.objects["Figure"].data.shape_keys.key_blocks) == 9
    assert left_in(temporary) == []


def begin(figure: bpy.types.Object) -> int:
    """Start a bake as the button does; the number of the process that does the work."""
    plan = plan_bake(figure, BakeRequest(("Basis", "Lean"), 400, FitOptions(quality="finest"), play_on="slider"))
    job = jobs.begin("Bake In-Betweens", plan.task, Limits())
    wait_for(lambda: job.poll() or job.stage != "Starting", "the first stage")
    return job._worker._process.pid


@pytest.mark.parametrize("are_handlers_gone", [False, True])
def test_the_addon_is_switched_off_while_it_bakes(
    figure: bpy.types.Object, state: State, temporary: Path, are_handlers_gone: bool
) -> None:
    before = state()
    child = begin(figure)
    if are_handlers_gone:  # as another add-on may leave them
        for name in dir(bpy.app.handlers):
            if isinstance(getattr(bpy.app.handlers, name), list):
                getattr(bpy.app.handlers, name).clear()
    qc3d_addon.unregister()
    assert jobs.current() is None
    assert is_gone(child)
    assert left_in(temporary) == []
    assert state() == before
    assert not hasattr(bpy.types.Object, "qc3d")
    qc3d_addon.register()
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key="Lean", mode="straight"
    ) == {"FINISHED"}


def test_another_file_is_loaded_while_it_bakes(figure: bpy.types.Object, temporary: Path) -> None:
    child = begin(figure)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert jobs.current() is None
    assert is_gone(child)
    assert left_in(temporary) == []


@pytest.mark.usefixtures("quick_map")
def test_the_addon_is_switched_off_while_a_file_is_saved(figure: bpy.types.Object, tmp_path: Path) -> None:
    """By a handler of somebody else: the preview, which was put away for saving, does not come back."""
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=1) == {"FINISHED"}
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}

    def switch_off(*_: object) -> None:
        qc3d_addon.unregister()

    bpy.app.handlers.save_pre.append(switch_off)
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    finally:
        bpy.app.handlers.save_pre.remove(switch_off)
        qc3d_addon.register()
    assert not live_scrub.is_on(figure)
    assert live_scrub.KEY not in figure.data.shape_keys.key_blocks
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b.blend"))
    assert live_scrub.KEY not in figure.data.shape_keys.key_blocks
