# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panel for other programs."""

from __future__ import annotations

import bpy

from ..kinds import present
from ..operators.exports import QC3D_OT_export_in_betweens, QC3D_OT_read_usd
from ..store import checks
from .panels import IN_THE_SIDEBAR, QC3D_PT_inbetweens


class QC3D_PT_exports(bpy.types.Panel):
    """Buttons that export in-betweens to other programs and read them back."""

    bl_label = "Other Programs"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "QC3D"
    bl_parent_id = QC3D_PT_inbetweens.__name__
    bl_options = {'DEFAULT_CLOSED'}  # noqa: RUF012 - as Blender's own classes have it

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return checks.object_problem(context.active_object) is None

    def draw(self, context: bpy.types.Context) -> None:
        column = present(self.layout).column(align=True)
        column.operator_context = IN_THE_SIDEBAR
        for ending, text in (('.usdc', "USD"), ('.fbx', "FBX"), ('.glb', "glTF")):
            button = column.operator(QC3D_OT_export_in_betweens.bl_idname, text=f"Export {text}", icon='EXPORT')
            button.format = ending
        column.separator()
        column.operator(QC3D_OT_read_usd.bl_idname, icon='IMPORT')
