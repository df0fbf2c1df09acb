# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender --background --command qc3d``: Ctrl-C ends it, although Blender without a window hides it from Python."""

from __future__ import annotations

import signal
import subprocess
import time
from pathlib import Path

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
