# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that shows the straight blend in place of in-betweens, and these again."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

import bpy

from ...solver.errors import QC3DError
from .. import live_scrub
from ..keys import straight
from ..kinds import keys_of
from ..store import checks
from .common import SLIDER, Status, chosen_chain, poll_chains, report_error


class QC3D_OT_straight(bpy.types.Operator):
    """Show the straight blend, as it was before the bake, to compare; again to show the in-betweens"""

    bl_idname = "qc3d.straight"
    bl_label = "Before"
    bl_options = {'UNDO'}

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        live_scrub.end()
        try:
            obj = checks.require_object(context.active_object)
            chain = chosen_chain(obj, self.slider)
            if straight.is_on(keys_of(obj), chain):
                straight.hide(obj, chain)
            else:
                straight.show(obj, chain)
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        return {'FINISHED'}
