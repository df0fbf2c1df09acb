# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that makes the map of two keys ahead of baking."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import ClassVar

import bpy

from ...solver.errors import QC3DError
from ...solver.settings import Settings
from .. import bake
from ..properties import PairChoices, fill_from_panel
from .common import poll_active_object, progress_shown


class QC3D_OT_prepare(PairChoices, bpy.types.Operator):
    """Make the map between two shape keys anew and keep it with them, so that later bakes only make frames"""

    bl_idname = "qc3d.prepare"
    bl_label = "Prepare"
    bl_options: ClassVar[set[str]] = {'UNDO'}  # no panel to adjust it: each change would run it all again

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        obj = context.active_object
        fill_from_panel(self.properties, obj.qc3d)
        settings = Settings(engine=self.engine, quality=self.quality)
        try:
            with progress_shown(context) as on_progress:
                bake.prepare_object(obj, bake.BakeRequest(self.from_key, self.to_key, settings=settings), on_progress)
        except QC3DError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        self.report({'INFO'}, f"The map from '{self.from_key}' to '{self.to_key}' is ready.")
        return {'FINISHED'}
