# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C and SIGTERM at every stage of the command line: one sentence, and nothing written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals as Linux and macOS do")

# Runs the command and sends the signal when the named stage is reached, a second time a moment later if asked to.
PROGRAM = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background starts with Ctrl-C ignored
stage, number = sys.argv[1], int(sys.argv[2])
del sys.argv[1:3]

def strike(*arguments, **choices):
    os.kill(os.getpid(), number)
    raise SystemExit("the signal did not end it")  # it is handled before the next line of Python

if stage == "load":
    class Finder:
        def find_spec(self, name, *rest):
            if name == "scipy.sparse":
                strike()
    sys.meta_path.insert(0, Finder())
else:
    from qc3d_addon.cli import interpolate, progress_bars
    from qc3d_addon.solver.keys import files
    if stage == "read":
        files.open_archive = strike
    elif stage == "open":
        import bpy
        from qc3d_addon.blender.bake import run
        run._open = strike
    elif stage == "write":
        interpolate.write_frames = lambda path, *rest: (path.write_bytes(b"half"), strike())
    elif stage == "save":
        from qc3d_addon.blender.bake import run
        write = run.write_bake
        run.write_bake = lambda *arguments: (write(*arguments), strike())
    elif stage == "tables":
        from qc3d_paper.drawing import slices
        slices.save_slices = strike
    else:
        seen = progress_bars.StageBars.__call__
        def struck(self, progress):
            if progress.stage == stage:
                strike()
            seen(self, progress)
        progress_bars.StageBars.__call__ = struck
from qc3d_addon.start import main
sys.exit(main())
"""
QUICK = ["--quality", "normal", "--engine", "delaunay"]


def interrupted(stage: str, arguments: list[str], folder: Path, number: int = signal.SIGINT) -> None:
    before = sorted(folder.rglob("*"))
    temporary = folder.parent / f"{folder.name}-temporary"
    temporary.mkdir()
    environment = {**os.environ, "TMPDIR": str(temporary)}
    command = [sys.executable, "-c", PROGRAM, stage, str(int(number)), *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
    assert done.stderr.strip().splitlines()[-1:] == ["qc3d: Interrupted; nothing was written."], done
    assert "Traceback" not in done.stderr
    assert done.returncode == 130
    assert sorted(folder.rglob("*")) == before
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("stage", ["load", "read", "mesh", "locate", "fit", "factor", "frames", "write"])
def test_interpolate(bar_file: Path, stage: str) -> None:
    keys = ["--from", "straight", "--to", "bent", "--frames", "1"]
    interrupted(
        stage,
        ["interpolate", bar_file.name, *keys, *QUICK, "--output", "frames.npz", "--report", "report.json"],
        bar_file.parent,
    )


@pytest.mark.parametrize("stage", ["open", "mesh", "frames", "save"])
def test_bake(bar_scene: Path, stage: str, tmp_path: Path) -> None:
    keys = ["--object", "Bar", "--from", "Basis", "--to", "Bent", "--frames", "1"]
    interrupted(
        stage,
        ["bake", str(bar_scene), *keys, *QUICK, "--output", "baked.blend", "--report", "report.json"],
        tmp_path,
    )


@pytest.mark.parametrize("stage", ["fit", "tables"])
def test_analyze(bar_file: Path, stage: str) -> None:
    keys = ["--from", "straight", "--to", "bent"]
    interrupted(stage, ["analyze", bar_file.name, *keys, *QUICK, "--output", "found"], bar_file.parent)


def test_the_system_asks_it_to_end(bar_file: Path) -> None:
    keys = ["--from", "straight", "--to", "bent", "--frames", "1"]
    arguments = ["interpolate", bar_file.name, *keys, *QUICK, "--output", "frames.npz"]
    interrupted("fit", arguments, bar_file.parent, signal.SIGTERM)
