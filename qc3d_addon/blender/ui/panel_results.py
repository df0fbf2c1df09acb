# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panel of the bakes: each control with the results of its bake."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ...solver.errors import InputError
from .. import live_scrub
from ..chains import to_key
from ..heat_map import heat_map
from ..keys import chain_keys, straight
from ..keys.double_motion import double_motion
from ..kinds import keys_of, present, shape_keys_of
from ..operators.bake_inbetweens import QC3D_OT_add_here, QC3D_OT_rebake
from ..operators.chains import (
    QC3D_OT_absolute_keys,
    QC3D_OT_export_alembic,
    QC3D_OT_mirror,
    QC3D_OT_play_on_key,
    QC3D_OT_remove,
    QC3D_OT_to_keyframes,
)
from ..operators.forget_record import QC3D_OT_forget_record
from ..operators.heat_map import QC3D_OT_heat_map, QC3D_OT_select_worst
from ..operators.live_scrub import QC3D_OT_live_scrub
from ..operators.map_files import QC3D_OT_save_map
from ..operators.straight import QC3D_OT_straight
from ..properties import settings_of
from ..store import checks, kept_measures, records
from ..store.chain import Chain
from ..store.records import Record
from ..store.summaries import Summary
from . import bake_list
from .panel_texts import draw_sentence
from .panels import QC3D_PT_inbetweens

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import IconItems

_MORE: tuple[tuple[type[bpy.types.Operator], IconItems], ...] = (
    (QC3D_OT_mirror, 'MOD_MIRROR'),
    (QC3D_OT_to_keyframes, 'KEYFRAME'),
    (QC3D_OT_absolute_keys, 'DUPLICATE'),
    (QC3D_OT_export_alembic, 'EXPORT'),
    (QC3D_OT_save_map, 'FILE_TICK'),
    (QC3D_OT_remove, 'TRASH'),
)
_STOPPED = "Blender stopped the drivers because the slider had no value (NaN) for a moment; re-bake to restart them."
_PROBLEMS = {"folds": "folds", "crossings": "new crossings", "collider_crossings": "crossings with colliders"}


class QC3D_PT_results(bpy.types.Panel):
    """The list of the active object's bakes, the newest first, and the details of the chosen one."""

    bl_label = "Baked In-Betweens"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "QC3D"
    bl_parent_id = QC3D_PT_inbetweens.__name__

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.active_object
        if obj is None or obj.type != 'MESH' or shape_keys_of(obj) is None:
            return False
        state = records.state(keys_of(obj))
        return state.chains > 0 or state.problem is not None

    def draw(self, context: bpy.types.Context) -> None:
        obj, layout = present(context.active_object), present(self.layout)
        try:
            chains = Record.read(keys_of(obj)).chains[::-1]
        except InputError as error:
            draw_sentence(context, layout, str(error), 'ERROR')
            if records.state(keys_of(obj)).is_damaged:
                layout.operator(QC3D_OT_forget_record.bl_idname, icon='TRASH')
            return
        if not chains:
            return
        chain = bake_list.draw(layout, obj, chains)
        # Keys may have been deleted, so that there are fewer than bakes.
        for left in chains[len(keys_of(obj).key_blocks) :]:
            layout.operator(QC3D_OT_remove.bl_idname, text=f"Remove {left.slider}", icon='TRASH').slider = left.slider
        box = layout.box()
        _draw_chain(context, box, obj, chain, is_listed=len(chains) > 1)
        _draw_double_motion(context, box, obj, chain, chains)


def _draw_chain(
    context: bpy.types.Context, layout: bpy.types.UILayout, obj: bpy.types.Object, chain: Chain, is_listed: bool
) -> None:
    control = chain_keys.control_of(obj, chain)
    control_problem = control.problem
    if control_problem is not None:
        draw_sentence(context, layout, control_problem, 'ERROR')
    elif not is_listed:  # else the list has it
        layout.prop(*control.shown, text=control.name, slider=True)
    original = chain_keys.original_of(obj, chain)
    if original is not None:
        sentence = f"The slider of '{original.name}' still plays these in-betweens; re-bake to have their own."
        draw_sentence(context, layout, sentence, 'ERROR')
    if chain_keys.are_drivers_stopped(keys_of(obj), chain):
        draw_sentence(context, layout, _STOPPED, 'ERROR')
    problem = checks.chain_problem(keys_of(obj), chain)
    buttons = layout.row(align=True)
    if problem is not None and chain.mirror_of:  # it has no keys of its own to be made from
        buttons.operator(QC3D_OT_mirror.bl_idname, text="Mirror Again", icon='MOD_MIRROR').slider = chain.mirror_of
    else:
        buttons.operator(QC3D_OT_rebake.bl_idname, icon='FILE_REFRESH').slider = chain.slider
        is_on = live_scrub.is_on(obj, chain.slider)
        buttons.operator(QC3D_OT_live_scrub.bl_idname, icon='PLAY', depress=is_on).slider = chain.slider
    is_straight = straight.is_on(keys_of(obj), chain)
    buttons = layout.row(align=True)
    buttons.operator(QC3D_OT_straight.bl_idname, icon='IPO_LINEAR', depress=is_straight).slider = chain.slider
    if not chain.mirror_of:
        buttons.operator(QC3D_OT_add_here.bl_idname, icon='ADD').slider = chain.slider
    if problem is not None and not chain.mirror_of:
        draw_sentence(context, layout, problem, 'ERROR')
    if chain.result is not None:
        _draw_result(context, layout, chain, chain.result)
        _draw_distortion(layout, obj, chain)
        for note in chain.result.notes:
            draw_sentence(context, layout, note)
    header, more = layout.panel(f"QC3D_more_{chain.slider}", default_closed=True)
    header.label(text="More")
    if more is not None:
        column = more.column(align=True)
        for operator, icon in _MORE[1:] if chain.mirror_of else _MORE:
            column.operator(operator.bl_idname, icon=icon).slider = chain.slider


def _draw_double_motion(
    context: bpy.types.Context, layout: bpy.types.UILayout, obj: bpy.types.Object, chain: Chain, chains: list[Chain]
) -> None:
    """Warnings about motion that adds to what the control shows, and the button that ends it if there is one."""
    found = double_motion(obj, chain, chains)
    for sentence in found:
        draw_sentence(context, layout, sentence, 'ERROR')
    if found and to_key.problem(obj, chain) is None:
        layout.operator(QC3D_OT_play_on_key.bl_idname, icon='SHAPEKEY_DATA').slider = chain.slider


def _draw_result(
    context: bpy.types.Context, layout: bpy.types.UILayout, chain: Chain, result: Summary
) -> None:
    facts = layout.column(align=True)
    facts.scale_y = 0.8
    if chain.mirror_of:
        draw_sentence(context, facts, f"Mirrored from {chain.mirror_of}", 'MOD_MIRROR')
    seconds = "" if chain.mirror_of else f" in {result.seconds:.1f} s"
    facts.label(text=f"{result.count} in-betweens{seconds}")
    counts = {what: count for name, what in _PROBLEMS.items() if (count := _count(result, name)) is not None}
    problems = [f"{count} {what}" for what, count in counts.items() if count]
    if counts:
        facts.label(
            text=", ".join(problems) or f"No {', no '.join(counts)}",
            icon='ERROR' if problems else 'CHECKMARK',
        )
    if result.played is not None:
        facts.label(text=f"Plays the motion within {result.played.distance:.2%} of the size")
        facts.label(text=f"Lengths hold within {result.played.stretch:.1%}")
        if result.played.volume is not None:
            facts.label(text=f"Volume holds within {result.played.volume:.1%}")
    if result.residual is None:
        facts.label(text="Straight lines, without a map")
    else:
        facts.label(text=f"Fitted within {result.residual:.2%} of the size")
        facts.label(text=f"Engine {result.engine}")


def _count(result: Summary, name: str) -> int | None:
    """Largest count of one kind of problem, at the in-betweens and between them; None if unknown."""
    counts = [getattr(result, name), getattr(result.played, name, None)]
    return max((count for count in counts if count is not None), default=None)


def _draw_distortion(layout: bpy.types.UILayout, obj: bpy.types.Object, chain: Chain) -> None:
    worst = None if chain.result is None else chain.result.worst
    if worst is not None:
        row = layout.row(align=True)
        row.label(text=f"Worst stretch +{worst.excess:.1%} at {worst.at:.2f}")
        row.operator(QC3D_OT_select_worst.bl_idname, text="", icon='RESTRICT_SELECT_OFF').slider = chain.slider
    if kept_measures.has(keys_of(obj), chain.slider):
        state = heat_map.shown(obj)
        row = layout.row(align=True)
        row.prop(settings_of(obj), "measure", text="")
        is_shown = state is not None and (state.slider, state.measure) == (chain.slider, settings_of(obj).measure)
        button = row.operator(QC3D_OT_heat_map.bl_idname, icon='SHADING_RENDERED', depress=is_shown)
        button.slider, button.measure = chain.slider, settings_of(obj).measure
