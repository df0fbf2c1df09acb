# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that bake in-betweens, for the first time and again."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy

from .. import live_scrub
from ..bake.plan import Plan, plan_bake, request_again, write_bake
from ..properties import BakeChoices, bake_request, fill_from_panel, settings_of
from ..store import checks
from .child_work import ChildWork
from .common import SLIDER, chosen_chain, poll_active_object, poll_chains, poll_panel_keys

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome


class QC3D_OT_bake_inbetweens(BakeChoices, ChildWork, bpy.types.Operator):
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
        live_scrub.end()
        result = write_bake(plan, outcome)
        return [*result.notes, result.summary()]


class QC3D_OT_rebake(ChildWork, bpy.types.Operator):
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
        live_scrub.end()
        result = write_bake(plan, outcome)
        return [*result.notes, result.summary()]
