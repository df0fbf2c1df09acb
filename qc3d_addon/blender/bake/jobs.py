# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The one piece of work that runs in the background: how far it is, and how it is stopped."""

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
    """A task at work in a child process, as the panel shows it: one of a row of tasks, counted from 0.

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
        """How long it has been at work."""
        return clock.monotonic() - self._started

    def poll(self) -> Outcome | None:
        """The outcome when it is there; raises QC3DError where the work failed."""
        return self._worker.poll()

    @property
    def stage(self) -> str:
        """What it does now, in words."""
        return "Starting" if self._worker.progress is None else self._worker.progress.label

    @property
    def fraction(self) -> float:
        """How much of all the work is done, 0..1."""
        own = 0.0 if self._worker.progress is None else self._worker.progress.overall
        return (self._part + own) / self._parts

    def at_end(self, call: Callable[[], None]) -> None:
        """Call this when the job ends, in whatever way: Blender drops a running operator without asking it."""
        self._at_end.callback(call)

    def stop(self) -> None:
        """End the child process, remove its files, and do what was left for the end."""
        with self._at_end:
            self._worker.close()


_current: Job | None = None


def current() -> Job | None:
    """The job that runs now."""
    return _current


def begin(label: str, task: Task, limits: Limits, part: int = 0, parts: int = 1) -> Job:
    """Start a job, or one of a row of them; there is never more than one at work.

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
    return None if _current is None else f"{_current.label} is at work; wait for it or cancel it first."


def cancel() -> None:
    """Stop the job, if there is one; what waits for it finds out by ``is_cancelled``."""
    if _current is not None:
        _current.is_cancelled = True
        end()


def end() -> None:
    """Forget the job and free what it holds; nothing happens where there is none."""
    global _current
    job, _current = _current, None
    if job is not None:
        job.stop()


@compat.persistent
def _on_load(*_: object) -> None:
    cancel()  # what it was started for is gone


def register() -> None:
    """Stop the job when another file is loaded."""
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Stop the job."""
    compat.remove_handler(bpy.app.handlers.load_pre, _on_load)
    cancel()
