# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the panel's options: all but those that belong to one character or shot."""

from __future__ import annotations

from typing import ClassVar

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..store import checks

SETTINGS = (
    "count",
    "more",
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


class QC3D_PT_presets(PresetPanel, bpy.types.Panel):
    """The saved presets, behind the button in the panel's header."""

    bl_label = "Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "qc3d.add_preset"


class QC3D_OT_add_preset(AddPresetBase, bpy.types.Operator):  # type: ignore[misc]  # the first has no types
    """Save the panel's options as a preset, or remove the preset of that name"""

    bl_idname = "qc3d.add_preset"
    bl_label = "Add QC3D Preset"
    preset_menu = "QC3D_PT_presets"
    preset_subdir = FOLDER
    preset_defines: ClassVar[list[str]] = ["settings = bpy.context.active_object.qc3d"]
    preset_values: ClassVar[list[str]] = [f"settings.{name}" for name in SETTINGS]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        problem = checks.object_problem(context.active_object)
        if problem is not None:
            cls.poll_message_set(problem)
        return problem is None

