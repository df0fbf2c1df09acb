# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that opens the demo figure."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..bake import jobs
from ..kinds import present
from .common import Status

FILE = Path(__file__).parents[2] / "demo" / "figure.blend"


class QC3D_OT_open_demo(bpy.types.Operator):
    """Open a figure whose rig drives shape keys of its face, lids and arm, as a new file without a name"""

    bl_idname = "qc3d.open_demo"
    bl_label = "Open the QC3D Demo"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        problem = jobs.busy_problem()
        if problem is not None:
            cls.poll_message_set(problem)
        return problem is None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        if not bpy.data.is_dirty:
            return self.execute(context)
        return present(context.window_manager).invoke_confirm(
            self,
            event,
            title="Open the QC3D demo?",
            message="Changes that you did not save will be lost.",
            confirm_text="Discard and Open",
            icon='WARNING',
        )

    def execute(self, context: bpy.types.Context) -> Status:
        # As a startup file, it has no name, so that saving does not change the add-on's own copy.
        bpy.ops.wm.read_homefile(filepath=str(FILE), use_splash=False)
        return {'FINISHED'}
