# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C while a script bakes, and all endings of the child process: a message, and the file as it was."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

from qc3d_addon.blender import cli
from qc3d_addon.worker import child, client

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals as Linux and macOS do")

State = Callable[[], dict[str, Any]]
CHOICES = {"from_key": "Basis", "to_key": "Lean", "count": 2, "quality": 'normal', "engine": 'delaunay'}


@pytest.fixture
def temporary(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("operator", [bpy.ops.qc3d.bake_inbetweens, bpy.ops.qc3d.prepare], ids=["bake", "prepare"])
def test_an_interrupt_while_the_child_works(
    operator: Callable[..., Any],
    figure: bpy.types.Object,
    state: State,
    temporary: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    children, handler = [], signal.getsignal(signal.SIGINT)

    def poll(self: client.Worker) -> None:
        if self.progress is not None:
            children.append(self._process)
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(client.Worker, "poll", poll)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # as Blender without its window, which keeps it for itself
    before = state()
    choices = {name: CHOICES[name] for name in CHOICES if name != "count" or operator is bpy.ops.qc3d.bake_inbetweens}
    try:
        with pytest.raises(RuntimeError, match="was interrupted; nothing was changed"):
            operator(**choices)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, handler)
    assert children[0].poll() is not None
    assert state() == before
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", "was ended by SIGKILL"),
        ("os.abort()", "was ended by SIGABRT"),
        ("os._exit(0)", r"without a result \(exit status 0\)"),
        ("os.write(1, b'garbage' + bytes(1)); time.sleep(600)", "sent invalid data"),
        ("os.write(1, b'{\"done\": true}' + bytes(1))", "cannot be read"),
        ("os.write(1, b'{\"error\": [\"MemoryError\", \"\"]}' + bytes(1))", "not enough memory within its limit"),
    ],
)
def test_each_ending_of_the_child_leaves_the_file_as_it_was(
    figure: bpy.types.Object, state: State, temporary: Path, monkeypatch: pytest.MonkeyPatch, line: str, said: str
) -> None:
    script = temporary / "child.py"
    # A child first reads that it may begin; what it says before that is forgotten.
    script.write_text(f"import os, signal, sys, time\nsys.stdin.buffer.readline()\n{line}\n")
    monkeypatch.setattr(child, "CHILD", script)
    before = state()
    with pytest.raises(RuntimeError, match=said):
        bpy.ops.qc3d.bake_inbetweens(play_on="slider", **CHOICES)
    assert state() == before
    assert list(temporary.iterdir()) == [script]


def test_an_interrupt_of_blenders_command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from qc3d_addon.cli import main as command

    def main(arguments: list[str]) -> int:
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError("not interrupted")

    monkeypatch.setattr(command, "main", main)
    assert cli.run_command([]) == 130
    assert capsys.readouterr().err == "qc3d: Interrupted; nothing was written.\n"
