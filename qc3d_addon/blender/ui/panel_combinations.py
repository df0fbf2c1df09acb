# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panel for combinations of keys."""

from __future__ import annotations

import bpy

from ...solver.errors import InputError
from ..combinations import verdicts
from ..kinds import keys_of, present
from ..operators.combinations import QC3D_OT_combine_keys, QC3D_OT_judge_pairs, QC3D_OT_remove_combination
from ..store import checks, combined_keys
from .panel_texts import draw_sentence, fitted
from .panels import IN_THE_SIDEBAR, QC3D_PT_inbetweens

_MOST_ROWS = 12


class QC3D_PT_combinations(bpy.types.Panel):
    """The combinations that were made, and the pairs that need one."""

    bl_label = "Keys at Once"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "QC3D"
    bl_parent_id = QC3D_PT_inbetweens.__name__
    bl_options = {'DEFAULT_CLOSED'}  # noqa: RUF012 - as Blender's own classes have it

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return checks.object_problem(context.active_object) is None

    def draw(self, context: bpy.types.Context) -> None:
        layout, obj = present(self.layout), present(context.active_object)
        buttons = layout.column(align=True)
        buttons.operator_context = IN_THE_SIDEBAR
        buttons.operator(QC3D_OT_combine_keys.bl_idname, text="Combine Keys…", icon='MOD_BOOLEAN')
        buttons.operator(QC3D_OT_judge_pairs.bl_idname, icon='VIEWZOOM')
        try:
            made = combined_keys.read(keys_of(obj))
        except InputError as error:
            draw_sentence(context, layout, str(error), 'ERROR')
            return
        for one in made:
            row = layout.row(align=True)
            outdated = combined_keys.is_outdated(keys_of(obj), one)
            label = " + ".join(fitted(context, name, 0.6 / len(one.keys)) for name in one.keys)
            row.label(text=label, icon='ERROR' if outdated else 'CHECKMARK')
            again = row.operator(QC3D_OT_combine_keys.bl_idname, text="", icon='FILE_REFRESH')
            again.first, again.second, again.third = (*one.keys, "")[:3]
            again.find_order = False
            if len(one.keys) == 2:
                turned = row.operator(QC3D_OT_combine_keys.bl_idname, text="", icon='ARROW_LEFTRIGHT')
                turned.first, turned.second, turned.find_order = one.keys[1], one.keys[0], False
            row.operator(QC3D_OT_remove_combination.bl_idname, text="", icon='TRASH').label = one.label
            if outdated:
                draw_sentence(context, layout, "Its keys have changed since; combine them again.", 'ERROR')
        _draw_verdicts(context, layout, obj, {frozenset(one.keys) for one in made})


def _draw_verdicts(
    context: bpy.types.Context, layout: bpy.types.UILayout, obj: bpy.types.Object, made: set[frozenset[str]]
) -> None:
    found = verdicts.found(obj)
    if not found:
        return
    needing = [one for one in found if not one.adding_is_right and {one.outer, one.inner} not in made]
    for one in needing[:_MOST_ROWS]:
        row = layout.row(align=True)
        outer, inner = (fitted(context, name, 0.35) for name in (one.outer, one.inner))
        row.label(text=f"{outer} + {inner}: {one.distance:.1%}", icon='ERROR')
        button = row.operator(QC3D_OT_combine_keys.bl_idname, text="", icon='MOD_BOOLEAN')
        button.first, button.second = one.outer, one.inner
    left = len(needing) - _MOST_ROWS
    if left > 0:
        layout.label(text=f"{left} more need a combination")
    right = sum(one.adding_is_right for one in found)
    draw_sentence(context, layout, f"Adding is right for {right} of {len(found)} pairs.", 'CHECKMARK')
