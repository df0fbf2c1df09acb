# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender's window: bakes, undoes, redoes, bakes again, and writes the shape keys after each step."""

import json
import sys
import traceback
from pathlib import Path

import bpy

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER))

import qc3d_addon  # noqa: E402

seen: dict[str, list[str]] = {}


def note(step: str) -> None:
    seen[step] = [key.name for key in bpy.data.objects["Cube"].data.shape_keys.key_blocks]


def bake() -> None:
    bpy.ops.qc3d.bake_inbetweens('EXEC_DEFAULT', True, from_key="Basis", to_key="Lean", count=1, quality='draft')


def steps() -> None:
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == 'VIEW_3D')
    region = next(region for region in area.regions if region.type == 'WINDOW')
    with bpy.context.temp_override(window=window, area=area, region=region):
        cube = bpy.data.objects["Cube"]
        cube.shape_key_add(name="Basis")
        lean = cube.shape_key_add(name="Lean", from_mix=False)
        lean.value = 0.0
        lean.points[0].co.x += 0.5
        bpy.ops.ed.undo_push(message="Keys")
        note("before")
        bake()
        note("baked")
        bpy.ops.ed.undo()
        note("undone")
        bpy.ops.ed.redo()
        note("redone")
        bake()
        note("again")


def run() -> None:
    try:
        steps()
        (FOLDER / "result.json").write_text(json.dumps(seen))
    except Exception:
        traceback.print_exc()
    bpy.ops.wm.quit_blender()


qc3d_addon.register()
bpy.app.timers.register(run, first_interval=2.0)
