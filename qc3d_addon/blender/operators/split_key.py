# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that splits a key into a left and a right one."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy
from bpy.props import FloatProperty, StringProperty

from ...solver.errors import QC3DError
from ..keys.split import split_key
from ..store import checks
from .common import Status, poll_active_object, report_error


class QC3D_OT_split_key(bpy.types.Operator):
    """Add a key for the left side of this key and one for the right side; added up, they are this key"""

    bl_idname = "qc3d.split_key"
    bl_label = "Split Key Left and Right"
    bl_options = {'REGISTER', 'UNDO'}

    if TYPE_CHECKING:
        key: str
        falloff: float
    else:
        key: StringProperty(
            name="Key", description="The key to split; by default the active one", options={'SKIP_SAVE'}
        )
        falloff: FloatProperty(
            name="Falloff",
            description="Distance from the middle, along x, over which one side fades into the other",
            default=0.1,
            min=0.0,
            subtype='DISTANCE',
            unit='LENGTH',
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        try:
            obj = checks.require_object(context.active_object)
            active = obj.active_shape_key
            name = self.key or (active.name if active is not None else "")
            made = split_key(obj, name, self.falloff)
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        self.report({'INFO'}, f"'{name}' was split into '{made[0]}' and '{made[1]}'.")
        return {'FINISHED'}
