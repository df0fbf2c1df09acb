# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The child process stays between bakes, and ends with the add-on."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import qc3d_addon
from qc3d_addon.blender.bake import jobs
from qc3d_addon.blender.properties import settings_of

ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]


def bake(to_key: str, count: int = 1) -> subprocess.Popen[bytes]:
    """Bake in-betweens; the process that waits for the next bake."""
    operator = bpy.ops.qc3d.bake_inbetweens
    assert operator(play_on="slider", from_key="Basis", to_key=to_key, count=count, more=False) == {"FINISHED"}
    child = jobs.standby()._child
    assert child is not None
    return child.process


def test_one_process_does_all_bakes(
    figure: bpy.types.Object, shapes: ReadShapes, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    process = bake("Lean")
    first = shapes(figure)
    assert bake("Stretch").pid == process.pid
    # The same again, from the map that the process remembers, and from the stored map in another one.
    assert bake("Lean").pid == process.pid
    again = shapes(figure)
    qc3d_addon.unregister()
    assert process.returncode is not None
    assert list(tmp_path.iterdir()) == []
    qc3d_addon.register()
    other = bake("Lean")
    assert other.pid != process.pid
    for name, shape in first.items():
        np.testing.assert_array_equal(again[name], shape)
        np.testing.assert_array_equal(shapes(figure)[name], shape)


def test_another_file_may_use_it(figure: bpy.types.Object, tmp_path: Path) -> None:
    process = bake("Lean")
    path = str(tmp_path / "figure.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bake("Stretch").pid == process.pid


def test_a_bake_that_cannot_begin_leaves_it_waiting(figure: bpy.types.Object) -> None:
    with pytest.raises(RuntimeError, match="choose two different keys"):
        bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Basis")
    child = jobs.standby()._child
    assert child is not None
    assert bake("Lean").pid == child.process.pid


def test_it_starts_while_keys_are_chosen_in_the_panel(
    figure: bpy.types.Object, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings_of(figure).last = "Stretch"  # by a script
    assert jobs.standby()._child is None
    monkeypatch.setattr(jobs, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    settings_of(figure).last = "Lean"
    child = jobs.standby()._child
    assert child is not None
    assert child.process.poll() is None
    assert bake("Lean").pid == child.process.pid
