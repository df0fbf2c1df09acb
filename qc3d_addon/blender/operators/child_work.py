# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators whose work runs in a child process, while the window goes on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import bpy

from ...solver.errors import QC3DError
from .. import compat, preferences
from ..bake import jobs, progress_bar
from ..bake.plan import Plan
from ..kinds import present
from .common import OperatorMixin, Status, report_error

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome
    from ...solver.support.progress import Progress

_TICK = 0.05  # seconds between looks at the child process


class ChildWork(OperatorMixin):
    """Plan the work, run it in a child process, write the outcome.

    An operator defines ``plan`` and ``write``; one with several plans returns the next from ``following`` and writes
    all outcomes in ``write_all``. Started from a button it is a modal operator, which Esc cancels with the mouse over
    the progress; called by a script or without a window, it blocks until the end. Nothing is written unless all of
    the work was done.
    """

    bl_options = {'UNDO'}  # without REGISTER: its adjustment panel would run everything again at each change

    def plan(self, context: bpy.types.Context) -> Plan | None:
        """What to compute, or None if there is nothing to do; raises QC3DError if it is impossible."""
        raise NotImplementedError

    def write(self, plan: Plan, outcome: Outcome) -> list[str]:
        """Write the outcome into the file; returns sentences for the user, the last of which says what was done."""
        raise NotImplementedError

    @property
    def part(self) -> tuple[int, int]:
        """Number of the running plan, from 0, and the number of plans."""
        return (0, 1)

    def following(self, context: bpy.types.Context, plan: Plan, outcome: Outcome | QC3DError) -> Plan | None:
        """The next plan, or None after the last."""
        return None

    def write_all(self, plan: Plan | None, outcome: Outcome | QC3DError | None) -> list[str]:
        """Write everything into the file after the last plan; raises QC3DError if nothing was written."""
        if isinstance(outcome, QC3DError):
            raise outcome
        assert plan is not None
        assert outcome is not None
        return self.write(plan, outcome)

    def execute(self, context: bpy.types.Context) -> Status:
        from ...worker import client

        manager = present(context.window_manager)
        try:
            problem = jobs.busy_problem()
            if problem is not None:
                raise_input(problem)
            following = self.plan(context)
            plan: Plan | None = None
            outcome: Outcome | QC3DError | None = None

            def show(reached: Progress) -> None:
                part, parts = self.part
                manager.progress_update((part + reached.overall) / parts)

            manager.progress_begin(0.0, 1.0)
            try:
                while following is not None:
                    plan = following
                    try:
                        with compat.interruptible():
                            outcome = client.run(plan.task, show, preferences.limits(context))
                    except QC3DError as error:
                        outcome = error
                    following = self.following(context, plan, outcome)
            finally:
                manager.progress_end()
            return self._finish(self.write_all(plan, outcome))
        except KeyboardInterrupt:
            report_error(self, f"{self.bl_label} was interrupted; nothing was changed.")
            return {'CANCELLED'}
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        if bpy.app.background or context.window is None:
            return self.execute(context)
        return self._guarded(context, lambda: self._begin(context, self.plan(context)))

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        is_escape = event.type == 'ESC' and event.value == 'PRESS'
        if is_escape and progress_bar.is_at(present(context.window), event.mouse_x, event.mouse_y):
            jobs.cancel()
        if self._job.is_cancelled:
            self.report({'INFO'}, f"{self.bl_label} was canceled; nothing was changed.")
            return {'CANCELLED'}
        if event.type != 'TIMER':
            return {'PASS_THROUGH'}
        return self._guarded(context, lambda: self._step(context))

    def _guarded(self, context: bpy.types.Context, work: Callable[[], Status]) -> Status:
        """Do a part of the work; if it fails, report why and leave nothing running."""
        try:
            return work()
        except QC3DError as error:
            jobs.end()
            report_error(self, str(error))
            return {'CANCELLED'}
        except BaseException:
            jobs.end()  # otherwise no other job could ever start
            raise

    def _begin(self, context: bpy.types.Context, plan: Plan | None) -> Status:
        """Start the work of the first plan."""
        if plan is None:
            return self._finish(self.write_all(None, None))
        problem = jobs.busy_problem()
        if problem is not None:
            report_error(self, problem)
            return {'CANCELLED'}
        self._start(context, plan)
        present(context.window_manager).modal_handler_add(self)
        self._show(context)
        return {'RUNNING_MODAL'}

    def _start(self, context: bpy.types.Context, plan: Plan) -> None:
        self._plan = plan
        self._job = jobs.begin(self.bl_label, plan.task, preferences.limits(context), *self.part)
        timer = present(context.window_manager).event_timer_add(_TICK, window=context.window)
        self._job.at_end(partial(_leave_window, timer))

    def _step(self, context: bpy.types.Context) -> Status:
        """Poll the child process; start the next plan after one, and finish after the last."""
        outcome: Outcome | QC3DError | None
        try:
            outcome = self._job.poll()
        except QC3DError as error:
            outcome = error
        if outcome is None:
            self._show(context)
            return {'PASS_THROUGH'}
        jobs.end()
        following = self.following(context, self._plan, outcome)
        if following is None:
            return self._finish(self.write_all(self._plan, outcome))
        self._start(context, following)
        return {'PASS_THROUGH'}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator because the window closes, another file is loaded or the add-on is disabled."""
        jobs.cancel()

    def _finish(self, sentences: list[str]) -> Status:
        *notes, summary = sentences
        for note in notes:
            self.report({'WARNING'}, note)
        self.report({'INFO'}, summary)
        return {'FINISHED'}

    def _show(self, context: bpy.types.Context) -> None:
        shown = (self._job.stage, round(self._job.fraction, 2), int(self._job.seconds))
        if shown != getattr(self, "_shown", None):  # needless redraws would make the window sluggish
            self._shown = shown
            progress_bar.show(context)


def raise_input(problem: str) -> None:
    """Raise InputError with this sentence."""
    from ...solver.errors import InputError

    raise InputError(problem)


def _leave_window(timer: bpy.types.Timer) -> None:
    present(bpy.context.window_manager).event_timer_remove(timer)
    progress_bar.clear()
