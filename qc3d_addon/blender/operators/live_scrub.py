# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that switches live scrub on and off."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy

from .. import live_scrub
from ..bake.plan import Plan
from ..bake.plan_again import plan_preview
from ..keys import straight
from ..store import checks
from .child_work import ChildWork
from .common import SLIDER, Status, chosen_chain, poll_chains

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome


class QC3D_OT_live_scrub(ChildWork[Plan, "Outcome"], bpy.types.Operator):
    """Show the exact motion at every position of the slider, not only the baked ones; click again to switch it off"""

    bl_idname = "qc3d.live_scrub"
    bl_label = "Live Scrub"
    bl_options = set()  # there is nothing to undo

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        return self._switched_off(context) or super().invoke(context, event)

    def execute(self, context: bpy.types.Context) -> Status:
        return self._switched_off(context) or super().execute(context)

    def plan(self, context: bpy.types.Context) -> Plan:
        obj = checks.require_object(context.active_object)
        chain = chosen_chain(obj, self.slider)
        self.slider = chain.slider
        return plan_preview(obj, chain)

    def write(self, plan: Plan, outcome: "Outcome") -> list[str]:
        from ...solver.frames.key_times import KeyTimes
        from ...solver.frames.preview import PreviewCurve

        straight.end()
        chain = chosen_chain(plan.find_object(), self.slider)
        assert outcome.bake is not None
        key_times = KeyTimes.of(plan.request.frame_options, len(plan.request.keys) - 1)
        live_scrub.begin(plan, chain, PreviewCurve(outcome.bake.frames, key_times))
        return [f"Drag the slider '{chain.slider}': it now shows the exact motion."]

    def _switched_off(self, context: bpy.types.Context) -> Status | None:
        """Switch the preview off; None unless it was on for this slider."""
        is_same = live_scrub.is_on(context.active_object, self.slider)
        live_scrub.end()
        return {'FINISHED'} if is_same else None
