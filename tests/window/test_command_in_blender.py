# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender --background --command qc3d``: Ctrl-C ends it, although Blender without a window hides it from Python.

A batch starts further Blenders, each with the command again.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

from .conftest import FROM, TO, open_arm
from .harness import Window


def test_ctrl_c_ends_the_command(root: Path, repository: Path) -> None:
    with Window(root, (800, 600)) as window:
        open_arm(window, repository)
        window.ask("bpy.ops.wm.save_userpref()")  # which add-ons are enabled
        before = sorted(path.name for path in window.folder.iterdir())
        files = [str(window.inside / name) for name in ("arm.blend", "out.blend")]
        bake = ["bake", files[0], "--object", "Arm", "--from", FROM, "--to", TO, "--frames", "3", "--quality", "finest"]
        command = ["chroot", str(root), "blender", "--background", "--command", "qc3d", *bake, "--output", files[1]]
        with subprocess.Popen(
            command,
            env=window._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            memory = Path(f"/proc/{process.pid}/maps")
            window.wait(lambda: "scipy" in memory.read_text(), "the command loads the solver's libraries")
            time.sleep(1.0)
            process.send_signal(signal.SIGINT)
            said = process.communicate(timeout=60)[1]
        assert process.returncode == 130, said
        assert "qc3d: Interrupted; nothing was written.\n" in said
        assert sorted(path.name for path in window.folder.iterdir()) == before


JOB = """
[[job]]
file = "arm.blend"
object = "Arm"
from = "Basis"
to = "Bend and twist"
frames = {frames}
quality = "{quality}"
output = "out/{name}.blend"
"""


def batch(root: Path, window: Window) -> subprocess.Popen[str]:
    command = ["chroot", str(root), "blender", "--background", "--command", "qc3d", "batch"]
    return subprocess.Popen(
        [*command, str(window.inside / "jobs.toml")],
        env=window._environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def reported(window: Window) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((window.folder / "jobs.batch/report.json").read_text())
    return found


def test_a_batch_is_carried_out_stopped_and_resumed(root: Path, repository: Path) -> None:
    with Window(root, (800, 600)) as window:
        open_arm(window, repository)
        window.ask("bpy.ops.wm.save_userpref()")  # which add-ons are enabled
        out = window.folder / "out"
        jobs = [JOB.format(frames=1, quality="normal", name="first")]
        jobs += [JOB.format(frames=24, quality="finest", name=f"long{number}") for number in range(3)]
        (window.folder / "jobs.toml").write_text("".join(jobs))
        with batch(root, window) as process:
            window.wait((out / "first.blend").exists, "the first job is done")
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=120)
        assert process.returncode == 130, said
        assert "qc3d: Interrupted; what is done stays, and the same command goes on from here.\n" in said
        found = reported(window)
        assert found["done"] + found["stopped"] == 4
        assert found["done"] >= 1
        assert found["stopped"] >= 1
        assert sorted(path.name for path in out.iterdir()) == sorted(
            Path(job["outputs"][0]).name for job in found["jobs"] if job["ended"] == "done"
        )
        (window.folder / "jobs.toml").write_text(jobs[0] + JOB.format(frames=2, quality="normal", name="second"))
        with batch(root, window) as process:
            said, complaints = process.communicate(timeout=240)
        assert process.returncode == 0, complaints
        assert re.search(r"2 jobs in .* s: 1 done, 1 resumed\.", said), said
        assert reported(window)["failed"] == 0
        baked = str(window.inside / "out/second.blend")
        window.ask(f"bpy.ops.wm.open_mainfile(filepath={baked!r})")
        keys = window.ask("[key.name for key in bpy.data.objects['Arm'].data.shape_keys.key_blocks]")
        assert len(keys) > 4
