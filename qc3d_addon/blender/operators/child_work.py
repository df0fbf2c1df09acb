# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators whose work runs in a child process, while the window goes on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar, cast

import bpy

from ...solver.errors import QC3DError
from .. import compat, preferences
from ..bake import jobs, progress_bar
from ..kinds import present
from .common import OperatorMixin, Status, report_error

if TYPE_CHECKING:
    from ...worker.exchange import Job

    class HasTask(Protocol):
        """What an operator plans."""

        @property
        def task(self) -> Job:
            """What to compute."""

    Planned = TypeVar("Planned", bound=HasTask)
    Made = TypeVar("Made")

    class Typed(OperatorMixin, Generic[Planned, Made]):
        """For mypy only: Python keeps the types of a generic class alive, and Blender 4.5 then hangs when it exits."""
else:
    Planned = Made = None

    class Typed(OperatorMixin):
        """Takes the types that mypy reads, and is the same class with all of them."""

        def __class_getitem__(cls, types: object) -> type:
            return cls


_TICK = 0.05  # seconds between looks at the child process


class ChildWork(Typed[Planned, Made]):
    """Plan the work, run it in a child process, write the outcome.

    An operator defines ``plan`` and ``write``. Started from a button it is a modal operator, which Esc cancels with the
    mouse over the progress; called by a script or without a window, it blocks until the end. Nothing is written unless
    all of the work was done, or ``write_done`` says otherwise.
    """

    bl_options = {'UNDO'}  # without REGISTER: its adjustment panel would run everything again at each change

    def plan(self, context: bpy.types.Context) -> Planned:
        """What to compute; raises QC3DError if it is impossible."""
        raise NotImplementedError

    def write(self, plan: Planned, outcome: Made) -> list[str]:
        """Write the outcome into the file; returns sentences for the user, the last of which says what was done."""
        raise NotImplementedError

    def write_done(self, plan: Planned, job: jobs.Job) -> list[str]:
        """After a cancel, write what was done by then; returns sentences for the user, or none if there was nothing."""
        return []

    def execute(self, context: bpy.types.Context) -> Status:
        jobs.prepare()
        from ...worker import client

        manager = present(context.window_manager)
        try:
            problem = jobs.busy_problem()
            if problem is not None:
                raise_input(problem)
            plan = self.plan(context)
            manager.progress_begin(0.0, 1.0)
            try:
                with compat.interruptible():
                    outcome = client.run(
                        plan.task,
                        lambda reached: manager.progress_update(reached.overall),
                        preferences.limits(context),
                        jobs.standby(),
                    )
            finally:
                manager.progress_end()
            return self._finish(self.write(plan, cast("Made", outcome)))
        except KeyboardInterrupt:
            report_error(self, f"{self.bl_label} was interrupted; nothing was changed.")
            return {'CANCELLED'}
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        if bpy.app.background or context.window is None:
            return self.execute(context)
        jobs.prepare()
        return self._guarded(context, lambda: self._begin(context, self.plan(context)))

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        is_escape = event.type == 'ESC' and event.value == 'PRESS'
        if is_escape and progress_bar.is_at(present(context.window), event.mouse_x, event.mouse_y):
            jobs.cancel()
        if self._job.is_cancelled:
            return self._guarded(context, self._end_early)
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

    def _begin(self, context: bpy.types.Context, plan: Planned) -> Status:
        """Start the work."""
        problem = jobs.busy_problem()
        if problem is not None:
            report_error(self, problem)
            return {'CANCELLED'}
        self._plan = plan
        self._job = jobs.begin(self.bl_label, plan.task, preferences.limits(context))
        timer = present(context.window_manager).event_timer_add(_TICK, window=context.window)
        self._job.at_end(partial(_leave_window, timer))
        present(context.window_manager).modal_handler_add(self)
        self._show(context)
        return {'RUNNING_MODAL'}

    def _step(self, context: bpy.types.Context) -> Status:
        """Poll the child process; write after the end."""
        outcome = self._job.poll()
        if outcome is None:
            self._show(context)
            return {'PASS_THROUGH'}
        jobs.end()
        return self._finish(self.write(self._plan, cast("Made", outcome)))

    def _end_early(self) -> Status:
        sentences = self.write_done(self._plan, self._job)
        if sentences:
            return self._finish(sentences)
        self.report({'INFO'}, f"{self.bl_label} was canceled; nothing was changed.")
        return {'CANCELLED'}

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
