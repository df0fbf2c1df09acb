# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the panel's choices: everything but what belongs to one character and shot."""

from __future__ import annotations

from typing import ClassVar

import bpy
from bl_operators.presets import AddPresetBase

from ..store import checks

SETTINGS = (
    "count",
    "use_tolerance",
    "tolerance",
    "weights",
    "play_on",
    "mode",
    "quality",
    "easing",
    "stretch",
    "engine",
    "seed",
)
FOLDER = "qc3d"


class QC3D_MT_presets(bpy.types.Menu):
    """The saved choices."""

    bl_label = "Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"

    def draw(self, context: bpy.types.Context) -> None:
        self.draw_preset(context)


class QC3D_OT_add_preset(AddPresetBase, bpy.types.Operator):  # type: ignore[misc]  # the first has no types
    """Save the panel's choices under a name, or remove the preset of that name"""

    bl_idname = "qc3d.add_preset"
    bl_label = "Add QC3D Preset"
    preset_menu = "QC3D_MT_presets"
    preset_subdir = FOLDER
    preset_defines: ClassVar[list[str]] = ["settings = bpy.context.active_object.qc3d"]
    preset_values: ClassVar[list[str]] = [f"settings.{name}" for name in SETTINGS]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        problem = checks.object_problem(context.active_object)
        if problem is not None:
            cls.poll_message_set(problem)
        return problem is None


def draw(layout: bpy.types.UILayout) -> None:
    """The menu with a button to add the present choices and one to remove the preset that is shown."""
    row = layout.row(align=True)
    row.menu(QC3D_MT_presets.__name__, text=QC3D_MT_presets.bl_label)
    row.operator(QC3D_OT_add_preset.bl_idname, text="", icon='ADD')
    row.operator(QC3D_OT_add_preset.bl_idname, text="", icon='REMOVE').remove_active = True
