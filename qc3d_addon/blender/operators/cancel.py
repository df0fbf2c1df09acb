# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator behind the panel's Cancel."""

from __future__ import annotations

import bpy

from ..bake import jobs
from .common import Status


class QC3D_OT_cancel(bpy.types.Operator):
    """Stop the running work; nothing is changed. Esc does the same with the mouse here or over the status bar"""

    bl_idname = "qc3d.cancel"
    bl_label = "Cancel"
    bl_options = {'INTERNAL'}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.current() is None:
            cls.poll_message_set("No bake is running.")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> Status:
        jobs.cancel()
        return {'FINISHED'}
