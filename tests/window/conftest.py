# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender with a window for the tests of a module, and for each test the arm of the demo file in it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from .harness import Window, missing

FROM, TO = "Basis", "Bend and twist"


@pytest.fixture(scope="session")
def root() -> Path:
    """The folder to chroot into."""
    folder = os.environ.get("QC3D_BLENDER_ROOT")
    reason = missing(folder)
    if reason is not None:
        pytest.skip(reason)
    return Path(folder or "")


@pytest.fixture(scope="module")
def shared_window(root: Path) -> Iterator[Window]:
    # Small, since software has to draw it.
    with Window(root, (800, 600)) as window:
        yield window


@pytest.fixture
def window(shared_window: Window, repository: Path) -> Window:
    """Blender with the arm as the active object, both keys chosen, and the sidebar open on the add-on's tab."""
    open_arm(shared_window, repository)
    return shared_window


def open_arm(window: Window, repository: Path) -> None:
    """Open the demo file, choose both keys, open the sidebar."""
    shutil.copy(repository / "assets/limb.blend", window.folder / "arm.blend")
    window.ask(f"bpy.ops.wm.open_mainfile(filepath={str(window.inside / 'arm.blend')!r})")
    window.ask(Path(__file__).with_name("arm_scene.py").read_text())
    window.ask(
        f"""
bpy.context.view_layer.objects.active = arm()
arm().qc3d.play_on, arm().qc3d.count, arm().qc3d.more = "slider", 3, False
arm().qc3d.from_key, arm().qc3d.to_key = {FROM!r}, {TO!r}
view()[1].spaces.active.shading.type = 'WIREFRAME'
view()[1].spaces.active.overlay.show_overlays = False
remember("Opened")
"""
    )
    window.open_sidebar()
