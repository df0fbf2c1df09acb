# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel while a rig is active, as in Pose Mode: the sliders of the meshes that the rig moves."""

from __future__ import annotations

import bpy

from ..keys import straight
from ..keys.chain_keys import control_of
from ..kinds import keys_of
from ..operators.straight import QC3D_OT_straight
from ..properties import newest_first
from .panel_texts import draw_sentence


def meshes_of(rig: bpy.types.Object) -> list[bpy.types.Object]:
    """The meshes that a rig moves, by a modifier or as its children, sorted by name."""
    children = set(rig.children_recursive)
    meshes = [obj for obj in bpy.data.objects if obj.type == 'MESH' and obj.users_scene]
    return sorted((obj for obj in meshes if obj in children or _is_deformed(obj, rig)), key=lambda obj: obj.name)


def draw(context: bpy.types.Context, layout: bpy.types.UILayout, rig: bpy.types.Object) -> None:
    """The sliders of a rig, mesh by mesh."""
    baked = [(obj, chains) for obj in meshes_of(rig) if (chains := newest_first(obj))]
    for obj, chains in baked:
        column = layout.column(align=True)
        column.use_property_split = False
        column.label(text=obj.name, icon='OUTLINER_OB_MESH')
        for chain in chains:
            control = control_of(obj, chain)
            if control.problem is None:
                row = column.row(align=True)
                row.prop(*control.shown, text=control.name, slider=True)
                row.context_pointer_set("active_object", obj)  # what the operator works on
                is_straight = straight.is_on(keys_of(obj), chain)
                button = row.operator(QC3D_OT_straight.bl_idname, text="", icon='IPO_LINEAR', depress=is_straight)
                button.slider = chain.slider
            else:
                draw_sentence(context, column, control.problem, 'ERROR')
    if not baked:
        sentence = f"No mesh of '{rig.name}' has in-betweens yet; select a mesh with shape keys to bake some."
        draw_sentence(context, layout, sentence)


def _is_deformed(obj: bpy.types.Object, rig: bpy.types.Object) -> bool:
    return any(getattr(modifier, "object", None) == rig for modifier in obj.modifiers if modifier.type == 'ARMATURE')
