# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that computes the maps between keys before baking."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy

from ..bake.plan import Plan, plan_maps, write_maps
from ..bake.request import BakeRequest
from ..choices import MapChoices
from ..properties import fill_from_panel, fit_options, key_names, settings_of
from ..store import checks
from .child_work import ChildWork
from .common import poll_active_object, poll_panel_keys

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome


class QC3D_OT_prepare(MapChoices, ChildWork[Plan, "Outcome"], bpy.types.Operator):
    """Compute the map between the shape keys again and keep it, so that later bakes take less time"""

    bl_idname = "qc3d.prepare"
    bl_label = "Prepare"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context) and poll_panel_keys(cls, context)

    def plan(self, context: bpy.types.Context) -> Plan:
        obj = checks.require_object(context.active_object)
        fill_from_panel(self.properties, settings_of(obj))
        return plan_maps(obj, BakeRequest(key_names(self), 1, fit_options(self)))

    def write(self, plan: Plan, outcome: "Outcome") -> list[str]:
        write_maps(plan, outcome)
        return [f"The map from {' to '.join(repr(name) for name in plan.request.keys)} is ready."]
