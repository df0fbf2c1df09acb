# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The one job that runs in the background: its progress, and how it is stopped."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

import bpy

from .. import compat

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome, Task
    from ...worker.client import Limits


class Job:
    """A task that runs in a child process, as the panel shows it: number ``part``, from 0, of ``parts`` tasks.

    Raises
    ------
    WorkerError
        If the child process cannot be started.
    """

    def __init__(self, label: str, task: Task, limits: Limits, part: int = 0, parts: int = 1) -> None:
        from ...worker.client import Worker

        self.label = f"{label} ({part + 1} of {parts})" if parts > 1 else label
        self._part, self._parts = part, parts
        self.is_cancelled = False
        self._started = clock.monotonic()
        self._worker = Worker(task, limits)
        self._at_end = ExitStack()

    @property
    def seconds(self) -> float:
        """Time since its start, in seconds."""
        return clock.monotonic() - self._started

    def poll(self) -> Outcome | None:
        """The outcome once there is one, otherwise None; raises QC3DError if the task failed."""
        return self._worker.poll()

    @property
    def stage(self) -> str:
        """Name of the stage that runs now."""
        return "Starting" if self._worker.progress is None else self._worker.progress.label

    @property
    def fraction(self) -> float:
        """Fraction of all the tasks that is done, in [0, 1]."""
        own = 0.0 if self._worker.progress is None else self._worker.progress.overall
        return (self._part + own) / self._parts

    def at_end(self, call: Callable[[], None]) -> None:
        """Call this when the job ends in any way: Blender may drop a running operator without telling it."""
        self._at_end.callback(call)

    def stop(self) -> None:
        """End the child process, remove its files, and make the calls of ``at_end``."""
        with self._at_end:
            self._worker.close()


_current: Job | None = None


def current() -> Job | None:
    """The job that is running, or None."""
    return _current


def begin(label: str, task: Task, limits: Limits, part: int = 0, parts: int = 1) -> Job:
    """Start a job, or one of several in a row; at most one runs at a time.

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
    _current = Job(label, task, limits, part, parts)
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
    """Stop the job."""
    compat.remove_handler(bpy.app.handlers.load_pre, _on_load)
    cancel()
