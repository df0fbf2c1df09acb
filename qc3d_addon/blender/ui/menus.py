# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus, which its search looks through."""

from __future__ import annotations

import bpy

from ..kinds import present
from ..operators.bake_inbetweens import QC3D_OT_bake_inbetweens, QC3D_OT_rebake
from ..operators.bake_keys import QC3D_OT_bake_keys
from ..operators.bug_report import QC3D_OT_copy_report, QC3D_OT_save_report
from ..operators.open_demo import QC3D_OT_open_demo
from ..operators.split_key import QC3D_OT_split_key

_OTHER_WORDS = "(Breakdown, Tween)"  # what animators look for; Blender's search knows only what an entry says


def _draw_keys(menu: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Entries of the menu beside the list of shape keys: bake the active key, the selected ones, or all; split one."""
    layout = present(menu.layout)
    layout.separator()
    layout.operator(QC3D_OT_bake_inbetweens.bl_idname, icon='SHAPEKEY_DATA')
    layout.operator(QC3D_OT_bake_keys.bl_idname, text="Bake In-Betweens of Selected Keys").which = "selected"
    layout.operator(QC3D_OT_bake_keys.bl_idname, text="Bake In-Betweens of All Keys").which = "all"
    layout.operator(QC3D_OT_split_key.bl_idname)


def _draw_animation(menu: bpy.types.Menu, context: bpy.types.Context) -> None:
    """In *Object › Animation*: bake, and bake again."""
    layout = present(menu.layout)
    layout.separator()
    label = QC3D_OT_bake_inbetweens.bl_label
    layout.operator(QC3D_OT_bake_inbetweens.bl_idname, text=f"{label} {_OTHER_WORDS}", icon='SHAPEKEY_DATA')
    every = layout.operator(QC3D_OT_bake_keys.bl_idname, text=f"Bake In-Betweens of All Shape Keys {_OTHER_WORDS}")
    every.which = "all"
    layout.operator(QC3D_OT_rebake.bl_idname, text=f"Re-Bake In-Betweens {_OTHER_WORDS}")


def _draw_help(menu: bpy.types.Menu, context: bpy.types.Context) -> None:
    """In *Help*: the demo, and what a bug report needs."""
    layout = present(menu.layout)
    layout.separator()
    layout.operator_context = 'INVOKE_DEFAULT'  # it asks before unsaved changes are lost
    layout.operator(QC3D_OT_open_demo.bl_idname, icon='ARMATURE_DATA')
    layout.operator(QC3D_OT_copy_report.bl_idname, text="Copy QC3D Report for a Bug", icon='COPYDOWN')
    layout.operator(QC3D_OT_save_report.bl_idname, text="Save QC3D Report for a Bug", icon='FILE_TICK')


_ENTRIES = (
    (bpy.types.MESH_MT_shape_key_context_menu, _draw_keys),
    (bpy.types.VIEW3D_MT_object_animation, _draw_animation),
    (bpy.types.TOPBAR_MT_help, _draw_help),
)


def register() -> None:
    """Add the entries."""
    for menu, draw in _ENTRIES:
        menu.append(draw)  # type: ignore[arg-type,unused-ignore]  # 5.2's: no menu


def unregister() -> None:
    """Remove the entries."""
    for menu, draw in _ENTRIES:
        menu.remove(draw)  # type: ignore[arg-type,unused-ignore]  # 5.2's: no menu
