# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that deletes an unreadable record of earlier bakes."""

from __future__ import annotations

import bpy

from ..bake import bookkeeping
from ..kinds import keys_of, present
from ..store import records
from .common import Status, poll_active_object


class QC3D_OT_forget_record(bpy.types.Operator):
    """Delete the damaged record so that you can bake again; shape keys and sliders of earlier bakes stay as they are"""

    bl_idname = "qc3d.forget_record"
    bl_label = "Forget Damaged Record"
    bl_options = {'UNDO'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not poll_active_object(cls, context):
            return False
        is_damaged = records.state(keys_of(present(context.active_object))).is_damaged
        if not is_damaged:
            cls.poll_message_set("The record of earlier bakes is not damaged.")
        return is_damaged

    def execute(self, context: bpy.types.Context) -> Status:
        bookkeeping.forget_all(present(context.active_object))
        self.report({'INFO'}, "The record was deleted; keys and sliders of earlier bakes stay as ordinary ones.")
        return {'FINISHED'}
