# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that makes the maps between keys ahead of baking."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import ClassVar

import bpy

from ...solver.errors import QC3DError
from .. import bake
from ..properties import MapChoices, fill_from_panel, key_names, solver_settings
from .common import poll_active_object, progress_shown


class QC3D_OT_prepare(MapChoices, bpy.types.Operator):
    """Make the maps between the shape keys anew and keep them, so that later bakes only make frames"""

    bl_idname = "qc3d.prepare"
    bl_label = "Prepare"
    bl_options: ClassVar[set[str]] = {'UNDO'}  # no panel to adjust it: each change would run it all again

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = context.active_object
        fill_from_panel(self.properties, obj.qc3d)
        try:
            request = bake.BakeRequest(key_names(self), 1, solver_settings(self))
            with progress_shown(context, len(request.keys) - 1) as on_progress:
                bake.prepare_object(obj, request, on_progress)
        except QC3DError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        self.report({'INFO'}, f"The map from {' to '.join(repr(name) for name in request.keys)} is ready.")
        return {'FINISHED'}
