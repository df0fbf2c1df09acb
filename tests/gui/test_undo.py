# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo and redo of a bake, in a real Blender with its window: the Python module has neither.

QC3D_BLENDER_ROOT names a folder with a system to chroot into, with Blender, scipy, xvfb-run and software OpenGL in it,
and /proc and /dev mounted. Needs to run as root.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("undo_in_window.py")


@pytest.fixture
def blender_root() -> Path:
    root = Path(os.environ.get("QC3D_BLENDER_ROOT", ""))
    if not os.environ.get("QC3D_BLENDER_ROOT"):
        pytest.skip("QC3D_BLENDER_ROOT is not set: no Blender with a window to test in")
    for needed in ("usr/bin/blender", "usr/bin/xvfb-run", "proc/self", "dev/shm"):
        if not (root / needed).exists():
            pytest.skip(f"{root} has no {needed}")
    return root


@pytest.fixture
def inside(blender_root: Path, repository: Path) -> Iterator[Path]:
    """A folder inside the root with the add-on and the script."""
    folder = blender_root / "tmp" / f"qc3d-{os.getpid()}"
    shutil.copytree(repository / "qc3d_addon", folder / "qc3d_addon", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(SCRIPT, folder)
    yield folder
    shutil.rmtree(folder)


def test_a_bake_is_undone_and_redone_in_one_step(blender_root: Path, inside: Path) -> None:
    place = f"/tmp/{inside.name}"
    blender = f"blender --factory-startup --gpu-backend opengl --python {place}/{SCRIPT.name}"
    command = f"LIBGL_ALWAYS_SOFTWARE=1 LC_ALL=C.UTF-8 xvfb-run -a -s '-screen 0 1280x800x24' {blender}"
    environment = {"HOME": place, "PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "TMPDIR": "/tmp"}
    with (inside / "log.txt").open("w") as log:
        subprocess.run(
            ["chroot", str(blender_root), "sh", "-c", command],
            env=environment,
            stdout=log,
            stderr=subprocess.STDOUT,
            timeout=300,
            check=False,
        )
    result = inside / "result.json"
    assert result.exists(), (inside / "log.txt").read_text()[-3000:]
    keys = json.loads(result.read_text())
    own = ["Basis", "Lean"]
    made = ["Basis→Lean 1/2", "Basis→Lean 2/2"]
    assert keys == {"before": own, "baked": own + made, "undone": own, "redone": own + made, "again": own + made}
