# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registering the add-on is fast, and unregistering leaves nothing behind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import bpy

import qc3d_addon


def _known() -> set[str]:
    return {name for name in dir(bpy.types) if name.startswith("QC3D_")} | {
        name for name in dir(bpy.ops.qc3d) if not name.startswith("_")
    }


def test_disabling_leaves_nothing_behind_and_enabling_again_works() -> None:
    everything = _known()
    assert {"QC3D_OT_bake_inbetweens", "QC3D_OT_prepare", "QC3D_PT_inbetweens", "bake_inbetweens"} <= everything
    qc3d_addon.unregister()
    assert _known() == set()
    assert not hasattr(bpy.types.Object, "qc3d")
    qc3d_addon.register()
    assert _known() == everything


def test_registering_does_not_load_the_solver(repository: Path) -> None:
    """Loading scipy takes longer than all the rest; without it the add-on is there in some 0.05 s."""
    script = "\n".join(
        [
            "import bpy, numpy, sys",
            f"sys.path.insert(0, {str(repository)!r})",
            "import qc3d_addon",
            "qc3d_addon.register()",
            "print('scipy' in sys.modules)",
            "qc3d_addon.unregister()",
        ]
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "False" in run.stdout.split()


def test_the_package_can_be_imported_without_blender(repository: Path) -> None:
    script = f"import sys; sys.modules['bpy'] = None; sys.path.insert(0, {str(repository)!r}); import qc3d_addon"
    subprocess.run([sys.executable, "-c", script], check=True)


def test_menus_are_as_they_were() -> None:
    def of_ours() -> list[str]:
        found = (getattr(getattr(bpy.types, name), "draw", None) for name in dir(bpy.types))
        calls = [call.__module__ for draw in found for call in getattr(draw, "_draw_funcs", ())]
        return [module for module in calls if module.startswith("qc3d_addon")]

    assert of_ours()
    qc3d_addon.unregister()
    assert of_ours() == []
    qc3d_addon.register()
