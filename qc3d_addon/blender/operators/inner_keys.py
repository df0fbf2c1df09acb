# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators behind the panel's rows of keys between the first and the last."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy
from bpy.props import IntProperty

from ...solver.errors import QC3DError
from ..bake.suggested_keys import are_even, sculpted_between
from ..bake.timeline import keys_on_timeline
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
        settings = settings_of(present(context.active_object))
        before = settings.via[-1] if settings.via else None
        row = settings.via.add()
        if before is not None:  # half-way from there to the last key
            row.at = 0.5 * (before.at + 1.0)
        row.frame = (settings.frame_start if before is None else before.frame) + 1
        row.frame = max(row.frame, (row.frame - 1 + settings.frame_end) // 2)
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
    """Go through the keys named as in-betweens of the last one, such as Smile_25 and Smile_60, at their values"""

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
            report_error(self, f"No keys are named as in-betweens of '{settings.last}'.")
            return {'CANCELLED'}
        settings.from_key, settings.to_key = settings.first, settings.last
        settings.via_timing = "even" if are_even([*names.values()]) else "value"
        settings.via.clear()
        for name, place in names.items():
            row = settings.via.add()
            row.name, row.at = name, place
        return {'FINISHED'}


class QC3D_OT_keys_from_timeline(bpy.types.Operator):
    """Fill in the keys that your keyframes show one after another, with their frames"""

    bl_idname = "qc3d.keys_from_timeline"
    bl_label = "Keys from Timeline"
    bl_options = {'UNDO', 'INTERNAL'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        obj = present(context.active_object)
        try:
            row = keys_on_timeline(obj, present(context.scene).frame_current)
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        settings = settings_of(obj)
        settings.from_key, settings.to_key = row.keys[0], row.keys[-1]
        settings.frame_start, settings.frame_end = row.frames[0], row.frames[-1]
        settings.use_keyframes, settings.via_timing = True, "frame"
        settings.via.clear()
        for name, frame in zip(row.keys[1:-1], row.frames[1:-1], strict=True):
            inner = settings.via.add()
            inner.name, inner.frame = name, frame
        for note in row.notes:
            self.report({'WARNING'}, note)
        return {'FINISHED'}
