# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences: limits of time and memory for a bake."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy
from bpy.props import IntProperty

from .kinds import present

if TYPE_CHECKING:
    from ..worker.client import Limits

_PACKAGE = __package__.rpartition(".")[0]  # what Blender knows the add-on by
_MINUTES = 60


class QC3DPreferences(bpy.types.AddonPreferences):
    """Limits of the background process that computes a bake."""

    bl_idname = _PACKAGE

    if TYPE_CHECKING:
        time_limit: int
        memory_limit: int
    else:
        time_limit: IntProperty(
            name="Time Limit",
            description="Minutes after which a bake is stopped",
            default=_MINUTES,
            min=1,
            max=10_000,
        )
        memory_limit: IntProperty(
            name="Memory Limit",
            description="Megabytes of memory that a bake may use; 0 for three quarters of the machine's memory. A bake "
            "that would need more is not started; on Linux, one that uses more is stopped",
            default=0,
            min=0,
            max=10_000_000,
        )

    def draw(self, context: bpy.types.Context) -> None:
        layout = present(self.layout)
        layout.use_property_split = True
        layout.prop(self, "time_limit", text="Time Limit (Minutes)")
        layout.prop(self, "memory_limit", text="Memory Limit (MB)")
        layout.operator("qc3d.copy_report", icon='COPYDOWN')
        layout.operator("qc3d.save_report", icon='FILE_TICK')


def limits(context: bpy.types.Context) -> "Limits":
    """The limits of the child process, in seconds and megabytes."""
    from ..solver.support.memory import machine_limit_mb
    from ..worker.client import Limits

    preferences = context.preferences
    addon = None if preferences is None else preferences.addons.get(_PACKAGE)
    chosen = None if addon is None else addon.preferences
    minutes = _MINUTES if chosen is None else chosen.time_limit
    memory = 0 if chosen is None else chosen.memory_limit
    return Limits(60.0 * minutes, memory or machine_limit_mb())
