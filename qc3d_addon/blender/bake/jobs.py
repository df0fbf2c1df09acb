# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The one job that runs in the background: its progress, and how it is stopped."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import bpy

from .. import compat

if TYPE_CHECKING:
    from ...solver.combinations.corrections import Corrections
    from ...solver.errors import QC3DError
    from ...solver.frames.many import Run
    from ...solver.frames.task import Outcome, Task
    from ...worker.client import Limits
    from ...worker.standby import Standby


class Job:
    """A task, or a run of several, in a child process, as the panel shows it.

    Raises
    ------
    WorkerError
        If the child process cannot be started.
    """

    def __init__(self, label: str, task: Task | Run | Corrections, limits: Limits) -> None:
        from ...worker.client import Worker

        self.label = label
        self.is_cancelled = False
        self._started = clock.monotonic()
        self._worker: Worker[Any] = Worker(task, limits, standby())
        self._at_end = ExitStack()

    @property
    def seconds(self) -> float:
        """Time since its start, in seconds."""
        return clock.monotonic() - self._started

    def poll(self) -> object:
        """The result once there is one, otherwise None; raises QC3DError if the task failed."""
        result: object = self._worker.poll()
        return result

    def outcomes(self, otherwise: QC3DError) -> list[Outcome | QC3DError]:
        """The outcomes of a run's tasks that have ended by now, also after it was stopped; ``otherwise`` for others."""
        return self._worker.outcomes(otherwise)

    @property
    def stage(self) -> str:
        """Name of the stage that runs now."""
        return "Starting" if self._worker.progress is None else self._worker.progress.label

    @property
    def fraction(self) -> float:
        """Fraction that is done, in [0, 1]."""
        return 0.0 if self._worker.progress is None else self._worker.progress.overall

    def at_end(self, call: Callable[[], None]) -> None:
        """Call this when the job ends in any way: Blender may drop a running operator without telling it."""
        self._at_end.callback(call)

    def stop(self) -> None:
        """End the child process, remove its files, and make the calls of ``at_end``."""
        with self._at_end:
            self._worker.close()


_current: Job | None = None
_standby: Standby | None = None


def standby() -> Standby:
    """Where the child process waits between jobs."""
    global _standby
    if _standby is None:
        from ...worker.standby import Standby

        _standby = Standby()
    return _standby


def prepare() -> None:
    """Start the child process, if none is there, while Blender gets the job ready for it."""
    if _current is None:
        standby().prepare()


def prepare_ahead() -> None:
    """The same while the user still chooses what to bake; scripts, which bake at once if at all, need no such help."""
    if not bpy.app.background:
        prepare()


def current() -> Job | None:
    """The job that is running, or None."""
    return _current


def begin(label: str, task: Task | Run | Corrections, limits: Limits) -> Job:
    """Start a job; at most one runs at a time.

    Raises
    ------
    InputError
        If one is running.
    WorkerError
        If the child process cannot be started.
    """
    global _current
    from ...solver.errors import InputError

    if _current is not None:
        raise InputError(busy_problem() or "")
    _current = Job(label, task, limits)
    return _current


def busy_problem() -> str | None:
    """Why nothing new can be started, or None."""
    return None if _current is None else f"{_current.label} is running; wait for it or cancel it first."


def cancel() -> None:
    """Stop the job, if there is one; whoever waits for it sees ``is_cancelled``."""
    if _current is not None:
        _current.is_cancelled = True
        end()


def end() -> None:
    """Drop the job, if there is one, and free what it holds."""
    global _current
    job, _current = _current, None
    if job is not None:
        job.stop()


@compat.persistent
def _on_load(*_: object) -> None:
    cancel()  # its object belongs to the file that is being closed


def register() -> None:
    """Stop the job when another file is loaded."""
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Stop the job, and end the child process that waits for the next one."""
    global _standby
    compat.remove_handler(bpy.app.handlers.load_pre, _on_load)
    cancel()
    if _standby is not None:
        _standby.close()
        _standby = None
