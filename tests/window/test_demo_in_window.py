# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo in a window: it asks before it discards changes, and opens ready to bake and play."""

from __future__ import annotations

import time

from .harness import Window

OPEN = "with inside('UI'): bpy.ops.qc3d.open_demo('INVOKE_DEFAULT')"


def test_it_asks_first_and_opens_ready_to_bake(window: Window) -> None:
    window.ask("remember('Changed'); arm().name = 'Mine'")
    assert window.ask("bpy.data.is_dirty")
    window.ask(OPEN)
    time.sleep(1.0)
    window.press("Escape")
    time.sleep(1.0)
    assert "Mine" in window.ask("bpy.data.objects.keys()")
    window.ask(OPEN)
    time.sleep(1.0)
    window.press("Return")
    window.wait_for("'Lids' in bpy.data.objects")
    assert window.ask("bpy.data.filepath") == ""
    window.open_sidebar()
    assert window.ask("[arm().qc3d.first, arm().qc3d.last]") == ["Basis", "Bend"]
    assert window.ask("view()[1].spaces.active.region_3d.view_perspective") == "CAMERA"
