# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that bakes in-betweens."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import ClassVar

import bpy

from ...solver.errors import QC3DError
from .. import bake
from ..properties import BakeChoices, bake_request, fill_from_panel
from .common import poll_active_object, progress_shown


class QC3D_OT_bake_inbetweens(BakeChoices, bpy.types.Operator):
    """Fill in the frames between two shape keys or more, as new shape keys that one slider plays"""

    bl_idname = "qc3d.bake_inbetweens"
    bl_label = "Bake In-Betweens"
    bl_options: ClassVar[set[str]] = {'UNDO'}  # no panel to adjust it: each change would run it all again

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = context.active_object
        fill_from_panel(self.properties, obj.qc3d)
        try:
            request = bake_request(self)
            with progress_shown(context, len(request.keys) - 1) as on_progress:
                result = bake.bake_object(obj, request, on_progress)
        except QC3DError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        for note in result.notes:
            self.report({'WARNING'}, note)
        self.report({'INFO'}, result.summary())
        return {'FINISHED'}
