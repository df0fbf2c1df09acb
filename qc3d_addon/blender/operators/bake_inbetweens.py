# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that bake in-betweens, for the first time and again."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty

from ..bake.plan import Plan, plan_bake, write_bake
from ..bake.plan_again import plan_one_more, request_again
from ..bake.together import objects_with_keys, plan_together, write_together
from ..choices import TimedChoices
from ..kinds import present
from ..properties import bake_request, fill_from_panel, settings_of, show_newest
from ..store import checks
from .child_work import ChildWork
from .common import SLIDER, chosen_chain, end_previews, poll_active_object, poll_chains, poll_panel_keys

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome


class QC3D_OT_bake_inbetweens(TimedChoices, ChildWork[Plan, "Outcome"], bpy.types.Operator):
    """Fill in the frames between two or more shape keys: new shape keys, all played by one slider or key"""

    bl_idname = "qc3d.bake_inbetweens"
    bl_label = "Bake In-Betweens"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context) and poll_panel_keys(cls, context)

    def plan(self, context: bpy.types.Context) -> Plan:
        obj = checks.require_object(context.active_object)
        fill_from_panel(self.properties, settings_of(obj))
        return plan_bake(obj, bake_request(self))

    def write(self, plan: Plan, outcome: "Outcome") -> list[str]:
        return _written(plan, outcome)


class QC3D_OT_rebake(ChildWork[Plan, "Outcome"], bpy.types.Operator):
    """Bake these in-betweens again with the same options, after their keys were sculpted; slider and drivers stay"""

    bl_idname = "qc3d.rebake"
    bl_label = "Re-Bake"

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def plan(self, context: bpy.types.Context) -> Plan:
        obj = context.active_object
        chain = chosen_chain(obj, self.slider)
        return plan_bake(obj, request_again(obj, chain))

    def write(self, plan: Plan, outcome: "Outcome") -> list[str]:
        return _written(plan, outcome)


class QC3D_OT_add_here(ChildWork[Plan, "Outcome"], bpy.types.Operator):
    """Bake again with one more in-between, at the value that the slider or key has now"""

    bl_idname = "qc3d.add_here"
    bl_label = "Add Here"

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def plan(self, context: bpy.types.Context) -> Plan:
        obj = context.active_object
        return plan_one_more(obj, chosen_chain(obj, self.slider))

    def write(self, plan: Plan, outcome: "Outcome") -> list[str]:
        return _written(plan, outcome)


class QC3D_OT_bake_objects(TimedChoices, ChildWork[Plan, "Outcome"], bpy.types.Operator):
    """Bake the selected objects that have these shape keys together, so that lashes stay on lids and clothes on skin"""

    bl_idname = "qc3d.bake_objects"
    bl_label = "Bake Selected Objects Together"

    if TYPE_CHECKING:
        one_control: bool
    else:
        one_control: BoolProperty(
            name="One Control",
            description="Let the key or slider of the active object drive those of the others, "
            "unless something else drives them",
            default=True,
            options={'SKIP_SAVE'},
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context) and poll_panel_keys(cls, context)

    def plan(self, context: bpy.types.Context) -> Plan:
        active = checks.require_object(context.active_object)
        fill_from_panel(self.properties, settings_of(active))
        request = bake_request(self)
        others = [obj for obj in present(context.selected_objects) if obj != active and obj.type == 'MESH']
        chosen = objects_with_keys(active, others, request.keys)
        self._left_out = [obj.name for obj in others if obj not in chosen]
        self._joint = plan_together(chosen, request)
        return replace(self._joint.plans[0], task=self._joint.task)

    def write(self, plan: Plan, outcome: "Outcome") -> list[str]:
        end_previews()
        results = write_together(self._joint, outcome, self.one_control)
        show_newest(plan.locate())
        notes = list(dict.fromkeys(note for result in results for note in result.notes))
        if self._left_out:
            names = ", ".join(f"'{name}'" for name in self._left_out)
            notes.append(f"Left out, because keys are missing or the same mesh was already baked: {names}.")
        return [*notes, f"{len(results)} objects baked together. {results[0].summary()}"]


def _written(plan: Plan, outcome: "Outcome") -> list[str]:
    """Write what a bake made and choose it in the list; sentences for the user."""
    end_previews()
    result = write_bake(plan, outcome)
    show_newest(plan.locate())
    return [*result.notes, result.summary()]
