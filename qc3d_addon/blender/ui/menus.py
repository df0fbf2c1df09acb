# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus."""

from __future__ import annotations

import bpy

from ..kinds import present
from ..operators.bake_keys import QC3D_OT_bake_keys
from ..operators.split_key import QC3D_OT_split_key


def _draw_keys(menu: bpy.types.Menu, context: bpy.types.Context) -> None:
    """In the menu beside the list of shape keys: bake those that are selected, or all; split one."""
    layout = present(menu.layout)
    layout.separator()
    layout.operator(
        QC3D_OT_bake_keys.bl_idname, text="Bake In-Betweens of Selected Keys", icon='SHAPEKEY_DATA'
    ).which = "selected"
    layout.operator(QC3D_OT_bake_keys.bl_idname, text="Bake In-Betweens of All Keys").which = "all"
    layout.operator(QC3D_OT_split_key.bl_idname)


def register() -> None:
    """Add the entries."""
    bpy.types.MESH_MT_shape_key_context_menu.append(_draw_keys)  # type: ignore[arg-type,unused-ignore]  # 5.2's: no menu


def unregister() -> None:
    """Take the entries away."""
    bpy.types.MESH_MT_shape_key_context_menu.remove(_draw_keys)  # type: ignore[arg-type,unused-ignore]  # 5.2's: no menu
