# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a task in a child process: reports progress, can stop it, and turns every kind of failure into a typed error."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar, cast, overload

from ..solver import errors
from ..solver.combinations.corrections import Corrected, Corrections
from ..solver.errors import QC3DError, WorkerError, with_remedy
from ..solver.files.private_folders import temporary_place
from ..solver.frames.many import Run
from ..solver.frames.task import Outcome, Task
from ..solver.support.progress import Done, OnProgress, Progress
from .child import Child
from .exchange import Job, folder_of, read_corrected, read_outcome, write_job
from .idleness import LONGEST_IDLE, Idleness
from .standby import Standby

_POLL_SECONDS = 0.02  # short beside any work, and long enough to take no processor time


@dataclass(frozen=True)
class Limits:
    """Limits of a child process.

    Parameters
    ----------
    seconds : float
        Time after which it is stopped, for each task.
    memory_mb : int
        Megabytes that it may allocate; 0 for no limit. Enforced on Linux only.
    """

    seconds: float = 3600.0
    memory_mb: int = 0


Outcomes = list[Outcome | QC3DError]
Result = TypeVar("Result", Outcome, Outcomes, Corrected)


class Worker(Generic[Result]):
    """A task, a run or corrections in a child process. Use it from one thread, and call ``close`` at the end.

    Parameters
    ----------
    job : Task, Run or Corrections
        What to compute. The result of a task is its outcome; that of a run the outcome of each of its tasks, or why it
        has none; that of corrections the corrected shapes.
    limits : Limits, optional
    standby : Standby, optional
        Where the child is taken from, if one waits there, and kept afterwards. Without it, the child ends with the job.

    Raises
    ------
    InputError
        If the job needs more memory than its limit.
    WorkerError
        If the child process cannot be started.
    """

    @overload
    def __init__(
        self: Worker[Outcome], job: Task, limits: Limits | None = None, standby: Standby | None = None
    ) -> None: ...
    @overload
    def __init__(
        self: Worker[Outcomes], job: Run, limits: Limits | None = None, standby: Standby | None = None
    ) -> None: ...
    @overload
    def __init__(
        self: Worker[Corrected], job: Corrections, limits: Limits | None = None, standby: Standby | None = None
    ) -> None: ...

    def __init__(self, job: Job, limits: Limits | None = None, standby: Standby | None = None) -> None:
        self._job = job
        self._limits = limits or Limits()
        job.require_memory(self._limits.memory_mb)
        self._standby = standby
        self._arrived: dict[int, Outcome | QC3DError] = {}
        self._is_closed = self._is_spoiled = False
        try:
            self._child = self._begun()
        except OSError as error:
            raise _not_started(error) from error
        self._process, self._inbox = self._child.process, self._child.inbox
        self._idleness = Idleness(self._process.pid)
        self._seconds = self._limits.seconds * (max(len(job.tasks), 1) if isinstance(job, Run) else 1)
        self._deadline = clock.monotonic() + self._seconds

    @property
    def progress(self) -> Progress | Done | None:
        """The latest progress; None before the first report."""
        return self._inbox.progress

    def poll(self) -> Result | None:
        """The result of the job, or None while it is running.

        Raises
        ------
        QC3DError
            The error that ended a task; a WorkerError if the process crashed or exceeded its limits. A run raises
            nothing: its result has the error in the place of each task that had not ended yet.
        """
        try:
            found: Outcome | Outcomes | Corrected | None = self._polled()
        except QC3DError as error:
            if not isinstance(self._job, Run):
                raise
            found = self.outcomes(error)
        return cast("Result | None", found)

    def outcomes(self, otherwise: QC3DError) -> Outcomes:
        """The outcomes of the tasks of a run that have ended by now, and for the others the error ``otherwise``."""
        assert isinstance(self._job, Run)
        self._collect()
        return [self._arrived.get(number, otherwise) for number in range(len(self._job.tasks))]

    def _polled(self) -> Outcome | Outcomes | Corrected | None:
        if not self._has_ended():
            self._collect()
            if self._inbox.is_garbled:
                self.close()
                raise WorkerError(_GARBLED)
            if self._idleness.lasts_too_long:
                self.close()
                raise WorkerError(_HANGS.format(LONGEST_IDLE))
            if clock.monotonic() > self._deadline:
                self.close()
                raise WorkerError(
                    f"The work was stopped after its time limit of {self._seconds:g} s; raise the limit in the "
                    "add-on's preferences, or choose a lower quality."
                )
            return None
        try:
            self._collect()
            result = self._result()
        finally:
            self.close()
        return result

    def _has_ended(self) -> bool:
        """Whether the job has ended: a child that stays has said so, any other has ended itself."""
        return (self._standby is not None and self._inbox.ending is not None) or self._child.has_ended()

    def _collect(self) -> None:
        """Read the outcomes of the tasks of a run that have ended since."""
        while not self._is_closed and not self._inbox.ended_tasks.empty():
            task, error = self._inbox.ended_tasks.get()
            if not isinstance(self._job, Run) or task is None or task >= len(self._job.tasks):
                self._inbox.is_garbled = True
            elif error is not None:
                self._arrived[task] = self._error(error)
            else:
                try:
                    found = self._read(folder_of(self._child.job, task), self._job.tasks[task])
                    self._arrived[task] = cast("Outcome", found)
                except WorkerError as unreadable:
                    self._arrived[task] = unreadable

    def _read(self, folder: Path, job: Task | Corrections) -> Outcome | Corrected:
        try:
            return read_corrected(folder, job) if isinstance(job, Corrections) else read_outcome(folder, job)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError) as error:
            self._is_spoiled = True
            raise WorkerError(f"The result of the work cannot be read: {error}; run it again.") from error

    def _error(self, told: tuple[str, str]) -> QC3DError:
        """The error that the child told by its type and its sentence."""
        kind, sentence = told
        if kind == MemoryError.__name__:
            error: QC3DError = WorkerError(_out_of_memory(self._limits))
        else:
            known = getattr(errors, kind, None)
            if not (isinstance(known, type) and issubclass(known, QC3DError)):
                known = WorkerError
            error = known(sentence)
        # What is not about the job, but about memory or files, may befall the next one too.
        self._is_spoiled |= isinstance(error, WorkerError)
        return error

    def close(self) -> None:
        """Stop the child, unless it has done its job and stays, and remove the job's files; again, do nothing."""
        if self._is_closed:
            return
        self._is_closed = True
        is_sound = self._inbox.ending is not None and not self._inbox.is_garbled and not self._is_spoiled
        if self._standby is not None and is_sound and self._child.put_away():
            self._standby.keep(self._child)
        else:
            self._child.close()

    def _begun(self) -> Child:
        """The child that does the job: the one that was kept, if it can still be told, or else a new one."""
        kept = None if self._standby is None else self._standby.taken()
        if kept is not None:
            if self._is_handed_to(kept):
                return kept
            kept.close()
        child = Child(0.0 if self._standby is None else self._standby.stay)
        self._is_handed_to(child)  # one that has ended already says itself how
        return child

    def _is_handed_to(self, child: Child) -> bool:
        try:
            write_job(child.take_new_job(), self._job)
            return child.begin(self._limits.memory_mb * 2**20)
        except BaseException:
            child.close()
            raise

    def _result(self) -> Outcome | Outcomes | Corrected:
        ending = self._inbox.ending
        if self._inbox.is_garbled:
            raise WorkerError(_GARBLED)
        if ending is not None and ending.error is not None:
            raise self._error(ending.error)
        if ending is None or (self._standby is None and self._process.returncode != 0):
            raise WorkerError(self._child.how_it_ended())
        if isinstance(self._job, Run):
            return self.outcomes(WorkerError(_GARBLED))
        return self._read(self._child.job, self._job)


_HANGS = (
    "The background process has done nothing for {:g} s and was stopped; nothing was changed. Memory may have run out: "
    "try again with a lower quality or fewer in-betweens."
)
_GARBLED = (
    "The background process sent invalid data and was stopped; nothing was changed. Try again, and report it if it "
    "happens again."
)


def _not_started(error: OSError) -> WorkerError:
    return WorkerError(
        f"The background process cannot be started with temporary files in {temporary_place()}: "
        f"{with_remedy(error)}."
    )


def _out_of_memory(limits: Limits) -> str:
    limit = f" within its limit of {limits.memory_mb} MB" if limits.memory_mb else ""
    more = ", or raise the limit in the add-on's preferences" if limits.memory_mb else ""
    return f"There is not enough memory{limit}; use fewer in-betweens, a lower quality or a smaller mesh{more}."


@overload
def run(
    job: Task, on_progress: OnProgress | None = None, limits: Limits | None = None, standby: Standby | None = None
) -> Outcome: ...
@overload
def run(
    job: Corrections,
    on_progress: OnProgress | None = None,
    limits: Limits | None = None,
    standby: Standby | None = None,
) -> Corrected: ...
@overload
def run(
    job: Run,
    on_progress: Callable[[Done], object] | None = None,
    limits: Limits | None = None,
    standby: Standby | None = None,
) -> Outcomes: ...
def run(
    job: Job,
    on_progress: Callable[..., object] | None = None,
    limits: Limits | None = None,
    standby: Standby | None = None,
) -> Outcome | Outcomes | Corrected:
    """Carry out a job in a child process and wait for its result.

    Raises
    ------
    QC3DError
        As ``Worker`` and ``Worker.poll``.
    """
    worker: Worker[Any] = Worker(job, limits, standby)
    shown = None
    try:
        while True:
            result = worker.poll()
            if on_progress is not None and worker.progress is not None and worker.progress != shown:
                shown = worker.progress
                on_progress(shown)
            if result is not None:
                return cast("Outcome | Outcomes | Corrected", result)
            clock.sleep(_POLL_SECONDS)
    finally:
        worker.close()
