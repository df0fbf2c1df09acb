# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the 3D view's sidebar."""

from __future__ import annotations

import textwrap

import bpy

from ..solver.errors import InputError
from . import checks, shape_keys, slider
from .operators.bake_inbetweens import QC3D_OT_bake_inbetweens
from .operators.inner_keys import QC3D_OT_add_inner_key, QC3D_OT_remove_inner_key
from .operators.prepare import QC3D_OT_prepare
from .properties import ObjectSettings, key_names
from .records import Record


class QC3D_PT_inbetweens(bpy.types.Panel):
    """The keys, the number of in-betweens, and the button."""

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
            _draw_choices(layout, obj)
            problem = checks.keys_problem(obj.data.shape_keys, key_names(obj.qc3d))
        buttons = layout.column()
        buttons.enabled = problem is None
        buttons.operator(QC3D_OT_bake_inbetweens.bl_idname, icon='SHAPEKEY_DATA')
        buttons.operator(QC3D_OT_prepare.bl_idname)
        if problem is not None:
            _draw_sentence(context, layout, problem)
        if obj is not None and obj.type == 'MESH' and obj.data.shape_keys is not None:
            _draw_sliders(context, layout, obj)


def _draw_choices(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    settings = obj.qc3d
    _draw_keys(layout, settings, obj.data.shape_keys)
    layout.prop(settings, "count")
    layout.prop(settings, "mode")
    layout.prop(settings, "quality")
    layout.prop(settings, "use_keyframes")
    if settings.use_keyframes:
        frames = layout.column(align=True)
        frames.prop(settings, "frame_start")
        frames.prop(settings, "frame_end")
    header, advanced = layout.panel("QC3D_advanced", default_closed=True)
    header.label(text="Advanced")
    if advanced is not None:
        for name in ("easing", "stretch", "extra_turns", "engine", "seed"):
            advanced.prop(settings, name)


def _draw_keys(layout: bpy.types.UILayout, settings: ObjectSettings, keys: bpy.types.Key) -> None:
    """A row for each key, in the order in which they are gone through."""
    layout.prop_search(settings, "from_key", keys, "key_blocks", icon='SHAPEKEY_DATA')
    for index, inner in enumerate(settings.via):
        row = layout.row(align=True)
        row.prop_search(inner, "name", keys, "key_blocks", text="Through", icon='SHAPEKEY_DATA')
        row.operator(QC3D_OT_remove_inner_key.bl_idname, text="", icon='REMOVE').index = index
    layout.prop_search(settings, "to_key", keys, "key_blocks", icon='SHAPEKEY_DATA')
    layout.operator(QC3D_OT_add_inner_key.bl_idname, icon='ADD')


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
