# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the 3D view's sidebar: the options, the button, and the progress."""

from __future__ import annotations

from typing import Literal

import bpy

from ...worker import engines
from ..bake import jobs, progress_bar, timeline
from ..bake.suggested_keys import made_keys, sculpted_between
from ..keys.leftovers import leftovers, sentence
from ..kinds import keys_of, present
from ..operators.bake_inbetweens import QC3D_OT_bake_inbetweens, QC3D_OT_bake_objects
from ..operators.bake_keys import QC3D_OT_bake_keys
from ..operators.cancel import QC3D_OT_cancel
from ..operators.inner_keys import (
    QC3D_OT_add_inner_key,
    QC3D_OT_go_through_sculpted,
    QC3D_OT_keys_from_timeline,
    QC3D_OT_remove_inner_key,
)
from ..operators.map_files import QC3D_OT_load_map
from ..operators.open_demo import QC3D_OT_open_demo
from ..operators.prepare import QC3D_OT_prepare
from ..properties import ObjectSettings, panel_keys, settings_of
from ..store import checks, records
from . import panel_rig, presets
from .panel_texts import draw_sentence

# Otherwise Blender calls the operators' poll as if the mouse were over the 3D view, not over this panel.
IN_THE_SIDEBAR: Literal['INVOKE_DEFAULT'] = 'INVOKE_DEFAULT'


class QC3D_PT_inbetweens(bpy.types.Panel):
    """The keys, the number of in-betweens, and the button."""

    bl_label = "QC3D"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "QC3D"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        if checks.object_problem(context.active_object) is None:
            presets.QC3D_PT_presets.draw_panel_header(present(self.layout))

    def draw(self, context: bpy.types.Context) -> None:
        layout = present(self.layout)
        layout.use_property_split = True
        layout.use_property_decorate = False
        obj = context.active_object
        if obj is not None and obj.type == 'ARMATURE':
            panel_rig.draw(context, layout, obj)
            if (job := jobs.current()) is not None:
                _draw_job(layout, job)
            return
        problem = checks.object_problem(obj)
        if obj is not None and problem is None:
            _draw_choices(layout, obj)
            joined = sentence(leftovers(keys_of(obj), made_keys(keys_of(obj))))
            if joined is not None:
                draw_sentence(context, layout, joined)
            problem = checks.keys_problem(keys_of(obj), panel_keys(settings_of(obj)))
        job = jobs.current()
        if job is not None:
            _draw_job(layout, job)
            return
        button = layout.column()
        button.operator_context = IN_THE_SIDEBAR
        button.scale_y = 1.4
        button.operator(QC3D_OT_bake_inbetweens.bl_idname, icon='SHAPEKEY_DATA')
        if checks.object_problem(obj) is None:
            every = layout.row(align=True)
            every.operator_context = IN_THE_SIDEBAR
            every.operator(QC3D_OT_bake_keys.bl_idname, text="Selected Keys").which = "selected"
            every.operator(QC3D_OT_bake_keys.bl_idname, text="All Keys").which = "all"
            if len(present(context.selected_objects)) > 1:
                together = layout.column()
                together.operator_context = IN_THE_SIDEBAR
                together.operator(QC3D_OT_bake_objects.bl_idname, icon='OUTLINER_OB_GROUP_INSTANCE')
        if problem is not None:
            draw_sentence(context, layout, problem)
            if checks.object_problem(obj) is not None:  # nothing to work on: something to try
                demo = layout.column()
                demo.operator_context = IN_THE_SIDEBAR
                demo.operator(QC3D_OT_open_demo.bl_idname, icon='ARMATURE_DATA')
            return
        obj = present(obj)
        notice = engines.engine_notice() if settings_of(obj).engine != 'delaunay' else None
        if notice is not None and not records.state(keys_of(obj)).chains:  # otherwise it stands with the results
            draw_sentence(context, layout, notice)


def _draw_choices(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    settings = settings_of(obj)
    _draw_keys(layout, obj, settings)
    amount = layout.column(align=True)
    amount.prop(settings, "tolerance" if settings.use_tolerance else "count")
    if not settings.use_tolerance:
        amount.prop(settings, "more")
    amount.prop(settings, "use_tolerance")
    look = layout.column()
    look.row().prop(settings, "play_on", expand=True)
    look.prop(settings, "mode")
    look.prop(settings, "quality")  # as buttons, Fine and Finest would both be cut off to Fin…
    look.prop_search(settings, "colliders", bpy.data, "collections")
    frames = layout.column(align=True)
    at_frames = len(settings.via) > 0 and settings.via_timing == "frame"
    if not at_frames:
        frames.prop(settings, "use_keyframes")
    if settings.use_keyframes or at_frames:
        frames.prop(settings, "frame_start")
        frames.prop(settings, "frame_end")
    header, advanced = layout.panel("QC3D_advanced", default_closed=True)
    header.label(text="Advanced")
    if advanced is not None:
        choices = advanced.column()
        for name in ("weights", "easing", "stretch", "extra_turns", "engine", "seed"):
            choices.prop(settings, name)
        advanced.operator_context = IN_THE_SIDEBAR
        row = advanced.row(align=True)
        row.operator(QC3D_OT_prepare.bl_idname)
        row.operator(QC3D_OT_load_map.bl_idname)


def _draw_keys(layout: bpy.types.UILayout, obj: bpy.types.Object, settings: ObjectSettings) -> None:
    """A row for each key, in the order of the motion."""
    keys = keys_of(obj)
    column = layout.column()
    column.prop_search(settings, "first", keys, "key_blocks", icon='SHAPEKEY_DATA')
    for index, inner in enumerate(settings.via):
        row = column.row(align=True)
        row.prop_search(inner, "name", keys, "key_blocks", text="Through", icon='SHAPEKEY_DATA')
        row.operator(QC3D_OT_remove_inner_key.bl_idname, text="", icon='REMOVE').index = index
        if settings.via_timing != "even":  # in a row of its own, so that the name keeps its room
            column.prop(inner, "at" if settings.via_timing == "value" else "frame")
    column.prop_search(settings, "last", keys, "key_blocks", icon='SHAPEKEY_DATA')
    if settings.via:
        column.row().prop(settings, "via_timing", expand=True)
    sculpted = {} if settings.via else sculpted_between(obj, settings.last)
    if sculpted:
        column.operator(
            QC3D_OT_go_through_sculpted.bl_idname, text=f"Go Through {', '.join(sculpted)}", icon='SCULPTMODE_HLT'
        )
    column.operator(QC3D_OT_add_inner_key.bl_idname, icon='ADD')
    if len(timeline.keyed(obj)) > 0:
        column.operator(QC3D_OT_keys_from_timeline.bl_idname, icon='TIME')


def _draw_job(layout: bpy.types.UILayout, job: jobs.Job) -> None:
    column = layout.column()
    column.label(text=f"{job.label}, {job.seconds:.0f} s")
    progress_bar.draw_bar(column, job)
    column.operator(QC3D_OT_cancel.bl_idname, icon='CANCEL')
