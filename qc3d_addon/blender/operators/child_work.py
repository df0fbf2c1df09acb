# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators whose work runs in a child process, while the window goes on."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import bpy

from ...solver.errors import QC3DError
from .. import compat, preferences
from ..bake import jobs, progress_bar
from ..bake.plan import Plan
from ..kinds import present
from .common import OperatorMixin, Status

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome
    from ...solver.support.progress import Progress

_TICK = 0.05  # seconds between looks at the child process


class ChildWork(OperatorMixin):
    """Plan the work, let a child process do it, write its outcome; an operator says how by ``plan`` and ``write``.

    From a button it is a modal operator that Esc ends; called by a script, or without a window, it runs to its end.
    Nothing is written unless all of the work was done.
    """

    bl_options = {'UNDO'}  # no panel to adjust it: each change would run it all again

    def plan(self, context: bpy.types.Context) -> Plan:
        """What to compute; raises QC3DError where it cannot be done."""
        raise NotImplementedError

    def write(self, plan: Plan, outcome: Outcome) -> list[str]:
        """Put what came of it into the file; sentences for the user, the last of them what was done."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> Status:
        from ...worker import client

        manager = present(context.window_manager)
        try:
            problem = jobs.busy_problem()
            if problem is not None:
                raise_input(problem)
            plan = self.plan(context)

            def show(reached: Progress) -> None:
                manager.progress_update(reached.overall)

            manager.progress_begin(0.0, 1.0)
            try:
                with compat.interruptible():
                    outcome = client.run(plan.task, show, preferences.limits(context))
            finally:
                manager.progress_end()
            return self._finish(plan, outcome)
        except KeyboardInterrupt:
            self.report({'ERROR'}, f"{self.bl_label} was interrupted; nothing was changed.")
            return {'CANCELLED'}
        except QC3DError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            self._plan = self.plan(context)
            self._job = jobs.begin(self.bl_label, self._plan.task, preferences.limits(context))
        except QC3DError as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        manager = present(context.window_manager)
        timer = manager.event_timer_add(_TICK, window=context.window)
        self._job.at_end(partial(_leave_window, timer))
        manager.modal_handler_add(self)
        self._show(context)
        return {'RUNNING_MODAL'}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        if event.type == 'ESC' and event.value == 'PRESS':
            jobs.cancel()
        if self._job.is_cancelled:
            self.report({'INFO'}, f"{self.bl_label} was cancelled; nothing was changed.")
            return {'CANCELLED'}
        if event.type != 'TIMER':
            return {'PASS_THROUGH'}
        try:
            outcome = self._job.poll()
            if outcome is None:
                self._show(context)
                return {'PASS_THROUGH'}
            jobs.end()
            return self._finish(self._plan, outcome)
        except QC3DError as error:
            jobs.end()
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        except BaseException:
            jobs.end()  # else no other could ever start
            raise

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator: the window closes, another file is loaded, the add-on is disabled."""
        jobs.cancel()

    def _finish(self, plan: Plan, outcome: Outcome) -> Status:
        *notes, summary = self.write(plan, outcome)
        for note in notes:
            self.report({'WARNING'}, note)
        self.report({'INFO'}, summary)
        return {'FINISHED'}

    def _show(self, context: bpy.types.Context) -> None:
        shown = (self._job.stage, round(self._job.fraction, 2), int(self._job.seconds))
        if shown != getattr(self, "_shown", None):  # drawing takes time from what the user does
            self._shown = shown
            progress_bar.show(context)


def raise_input(problem: str) -> None:
    """Raise InputError with this sentence."""
    from ...solver.errors import InputError

    raise InputError(problem)


def _leave_window(timer: bpy.types.Timer) -> None:
    present(bpy.context.window_manager).event_timer_remove(timer)
    progress_bar.clear()
