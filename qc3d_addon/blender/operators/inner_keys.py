# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators behind the panel's rows of keys between the first and the last."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy
from bpy.props import IntProperty

from ..bake.suggested_keys import sculpted_between
from ..kinds import present
from ..properties import settings_of
from .common import Status, poll_active_object, report_error


class QC3D_OT_add_inner_key(bpy.types.Operator):
    """Add a shape key for the motion to go through"""

    bl_idname = "qc3d.add_inner_key"
    bl_label = "Add Key Between"
    bl_options = {'UNDO', 'INTERNAL'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        settings_of(present(context.active_object)).via.add()
        return {'FINISHED'}


class QC3D_OT_remove_inner_key(bpy.types.Operator):
    """Remove this shape key from the motion"""

    bl_idname = "qc3d.remove_inner_key"
    bl_label = "Remove Key Between"
    bl_options = {'UNDO', 'INTERNAL'}

    if TYPE_CHECKING:
        index: int
    else:
        index: IntProperty(name="Row", description="Row of the key, from 0", min=0, options={'SKIP_SAVE'})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        rows = settings_of(present(context.active_object)).via
        if self.index >= len(rows):
            report_error(self, f"There is no row {self.index}; there are {len(rows)}.")
            return {'CANCELLED'}
        rows.remove(self.index)
        return {'FINISHED'}


class QC3D_OT_go_through_sculpted(bpy.types.Operator):
    """Go through the keys that are named as in-betweens of the last one, such as Smile_25, Smile_50 and Smile_75"""

    bl_idname = "qc3d.go_through_sculpted"
    bl_label = "Go Through Sculpted In-Betweens"
    bl_options = {'UNDO', 'INTERNAL'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        obj = present(context.active_object)
        settings = settings_of(obj)
        names = sculpted_between(obj, settings.last)
        if not names:
            report_error(self, f"No keys are named as evenly spaced in-betweens of '{settings.last}'.")
            return {'CANCELLED'}
        settings.from_key, settings.to_key = settings.first, settings.last
        settings.via.clear()
        for name in names:
            settings.via.add().name = name
        return {'FINISHED'}
