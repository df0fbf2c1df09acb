# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the 3D view's sidebar."""

from __future__ import annotations

import textwrap

import bpy

from ..solver.errors import InputError
from . import checks, shape_keys, slider
from .operators.bake_inbetweens import QC3D_OT_bake_inbetweens
from .operators.prepare import QC3D_OT_prepare
from .records import Record


class QC3D_PT_inbetweens(bpy.types.Panel):
    """Two keys, the number of in-betweens, and the button."""

    bl_label = "QC3D"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "QC3D"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        obj = context.active_object
        problem = checks.object_problem(obj)
        if problem is None:
            self._draw_choices(layout, obj)
            problem = checks.pair_problem(obj.data.shape_keys, obj.qc3d.from_key, obj.qc3d.to_key)
        buttons = layout.column()
        buttons.enabled = problem is None
        buttons.operator(QC3D_OT_bake_inbetweens.bl_idname, icon='SHAPEKEY_DATA')
        buttons.operator(QC3D_OT_prepare.bl_idname)
        if problem is not None:
            _draw_sentence(context, layout, problem)
        if obj is not None and obj.type == 'MESH' and obj.data.shape_keys is not None:
            _draw_sliders(context, layout, obj)

    def _draw_choices(self, layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
        settings, keys = obj.qc3d, obj.data.shape_keys
        layout.prop_search(settings, "from_key", keys, "key_blocks", icon='SHAPEKEY_DATA')
        layout.prop_search(settings, "to_key", keys, "key_blocks", icon='SHAPEKEY_DATA')
        layout.prop(settings, "count")
        layout.prop(settings, "mode")
        layout.prop(settings, "quality")
        layout.prop(settings, "engine")
        layout.prop(settings, "use_keyframes")
        if settings.use_keyframes:
            frames = layout.column(align=True)
            frames.prop(settings, "frame_start")
            frames.prop(settings, "frame_end")


def _draw_sliders(context: bpy.types.Context, layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    try:
        chains = Record.read(obj.data.shape_keys).chains
    except InputError as error:
        _draw_sentence(context, layout, str(error))
        return
    sliders = layout.column()
    sliders.use_property_split = False
    for chain in chains:
        owner = shape_keys.slider_owner(obj, chain)
        if chain.slider in owner:
            sliders.prop(owner, slider.data_path(chain.slider), text=chain.slider, slider=True)


def _draw_sentence(context: bpy.types.Context, layout: bpy.types.UILayout, sentence: str) -> None:
    """Draw a sentence over as many lines as the width of the sidebar asks for; Blender would cut it."""
    width = max(16, int(context.region.width / (7.0 * context.preferences.system.ui_scale)) - 4)
    lines = layout.column(align=True)
    for index, line in enumerate(textwrap.wrap(sentence, width)):
        lines.label(text=line, icon='INFO' if index == 0 else 'BLANK1')
