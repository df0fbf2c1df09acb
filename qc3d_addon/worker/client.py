# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a task in a child process: reports progress, can stop it, and turns every kind of failure into a typed error."""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import sys
import threading
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar, cast, overload

from ..solver import errors
from ..solver.combinations.corrections import Corrected, Corrections
from ..solver.errors import QC3DError, WorkerError, with_remedy
from ..solver.files.private_folders import PrivateFolder, temporary_place
from ..solver.frames.many import Run
from ..solver.frames.task import Outcome, Task
from ..solver.support.child_python import interpreter
from ..solver.support.progress import Done, OnProgress, Progress
from . import messages
from .exchange import (
    folder_of,
    read_corrected,
    read_outcome,
    write_corrections,
    write_run,
    write_task,
)
from .idleness import LONGEST_IDLE, Idleness
from .messages import Ending
from .processes import how_it_ended, kill, library_folders

CHILD = Path(__file__).with_name("task_child.py")
_POLL_SECONDS = 0.05  # short beside any work, and long enough to take no processor time
_LONGEST_MESSAGE = 1_000_000  # bytes; more without an end is not a message of ours


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
Job = Task | Run | Corrections
Result = TypeVar("Result", Outcome, Outcomes, Corrected)


class Worker(Generic[Result]):
    """A task, a run or corrections in a child process. Use it from one thread, and call ``close`` at the end.

    Parameters
    ----------
    job : Task, Run or Corrections
        What to compute. The result of a task is its outcome; that of a run the outcome of each of its tasks, or why it
        has none; that of corrections the corrected shapes.
    limits : Limits, optional

    Raises
    ------
    InputError
        If the job needs more memory than its limit.
    WorkerError
        If the child process cannot be started.
    """

    @overload
    def __init__(self: Worker[Outcome], job: Task, limits: Limits | None = None) -> None: ...
    @overload
    def __init__(self: Worker[Outcomes], job: Run, limits: Limits | None = None) -> None: ...
    @overload
    def __init__(self: Worker[Corrected], job: Corrections, limits: Limits | None = None) -> None: ...

    def __init__(self, job: Job, limits: Limits | None = None) -> None:
        self._job = job
        self._limits = limits or Limits()
        job.require_memory(self._limits.memory_mb)
        self._progress: Progress | Done | None = None
        self._ending: Ending | None = None
        self._ended_tasks: queue.SimpleQueue[Ending] = queue.SimpleQueue()
        self._arrived: dict[int, Outcome | QC3DError] = {}
        self._is_garbled = False
        self._is_closed = False
        try:
            self._folder = PrivateFolder()
        except OSError as error:
            raise _not_started(error) from error
        self._errors = self._folder.path / "errors.txt"
        try:
            if isinstance(job, Run):
                write_run(self._folder.path, job)
            elif isinstance(job, Corrections):
                write_corrections(self._folder.path, job)
            else:
                write_task(self._folder.path, job)
            self._process = self._start()
        except OSError as error:
            self._folder.close()
            raise _not_started(error) from error
        except BaseException:
            self._folder.close()
            raise
        self._idleness = Idleness(self._process.pid)
        self._seconds = self._limits.seconds * (max(len(job.tasks), 1) if isinstance(job, Run) else 1)
        self._deadline = clock.monotonic() + self._seconds
        self._reader = threading.Thread(target=self._read_messages, daemon=True)
        self._reader.start()

    @property
    def progress(self) -> Progress | Done | None:
        """The latest progress; None before the first report."""
        return self._progress

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
        if self._process.poll() is None:
            self._collect()
            if self._is_garbled:
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
        kill(self._process)  # processes that the child started may outlive it and keep the pipe open
        self._reader.join()
        try:
            self._collect()
            return self._result()
        finally:
            self.close()

    def _collect(self) -> None:
        """Read the outcomes of the tasks of a run that have ended since."""
        while not self._is_closed and not self._ended_tasks.empty():
            task, error = self._ended_tasks.get()
            if not isinstance(self._job, Run) or task is None or task >= len(self._job.tasks):
                self._is_garbled = True
            elif error is not None:
                self._arrived[task] = self._error(error)
            else:
                try:
                    found = self._read(folder_of(self._folder.path, task), self._job.tasks[task])
                    self._arrived[task] = cast("Outcome", found)
                except WorkerError as unreadable:
                    self._arrived[task] = unreadable

    @staticmethod
    def _read(folder: Path, job: Task | Corrections) -> Outcome | Corrected:
        try:
            return read_corrected(folder, job) if isinstance(job, Corrections) else read_outcome(folder, job)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError) as error:
            raise WorkerError(f"The result of the work cannot be read: {error}; run it again.") from error

    def _error(self, told: tuple[str, str]) -> QC3DError:
        """The error that the child told by its type and its sentence."""
        kind, sentence = told
        if kind == MemoryError.__name__:
            return WorkerError(_out_of_memory(self._limits))
        known = getattr(errors, kind, None)
        return known(sentence) if isinstance(known, type) and issubclass(known, QC3DError) else WorkerError(sentence)

    def close(self) -> None:
        """Stop the child if it is still running, and remove its files. Calling it again does nothing."""
        if self._is_closed:
            return
        self._is_closed = True
        kill(self._process)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        self._reader.join()
        self._process.stdout.close()
        self._folder.close()

    def _start(self) -> subprocess.Popen[bytes]:
        python = interpreter()
        if python is None:
            raise WorkerError(
                "No Python interpreter was found for the background process; install Blender with its own Python."
            )
        package = Path(__file__).resolve().parent.parent
        memory = self._limits.memory_mb * 2**20
        # Without the interpreter's own packages: the child must use the same libraries as this process.
        command = [python, "-I", "-S", CHILD, package, self._folder.path, memory, *library_folders()]
        flags = 0
        if sys.platform == "win32":
            flags = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP
            flags |= subprocess.BELOW_NORMAL_PRIORITY_CLASS  # the window that the user works in comes first
        with open(self._errors, "wb") as stream:
            return subprocess.Popen(
                [str(part) for part in command],
                stdin=subprocess.PIPE,  # never written to: when it closes, the child knows that this process is gone
                stdout=subprocess.PIPE,
                stderr=stream,
                creationflags=flags,
                start_new_session=sys.platform != "win32",
            )

    def _read_messages(self) -> None:
        """Read messages until the child closes the pipe; keep the latest progress and the final message."""
        stream = self._process.stdout
        assert stream is not None
        rest = b""
        while chunk := os.read(stream.fileno(), 65536):
            if self._is_garbled:
                continue  # keep reading: a child that cannot write would never end
            *whole, rest = (rest + chunk).split(b"\0")
            for text in whole:
                self._take(text)
            self._is_garbled |= len(rest) > _LONGEST_MESSAGE

    def _take(self, text: bytes) -> None:
        try:
            message = messages.parsed(text)
        except (ValueError, TypeError, RecursionError):
            self._is_garbled = True
            return
        if not isinstance(message, Ending):
            self._progress = message
        elif message.task is None:
            self._ending = message
        else:
            self._ended_tasks.put(message)

    def _result(self) -> Outcome | Outcomes | Corrected:
        ending, status = self._ending, self._process.returncode
        if self._is_garbled:
            raise WorkerError(_GARBLED)
        if ending is not None and ending.error is not None:
            raise self._error(ending.error)
        if ending is None or status != 0:
            raise WorkerError(how_it_ended(status, self._errors))
        if isinstance(self._job, Run):
            return self.outcomes(WorkerError(_GARBLED))
        return self._read(self._folder.path, self._job)


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
def run(job: Task, on_progress: OnProgress | None = None, limits: Limits | None = None) -> Outcome: ...
@overload
def run(job: Corrections, on_progress: OnProgress | None = None, limits: Limits | None = None) -> Corrected: ...
@overload
def run(job: Run, on_progress: Callable[[Done], object] | None = None, limits: Limits | None = None) -> Outcomes: ...
def run(
    job: Job, on_progress: Callable[..., object] | None = None, limits: Limits | None = None
) -> Outcome | Outcomes | Corrected:
    """Carry out a job in a child process and wait for its result.

    Raises
    ------
    QC3DError
        As ``Worker`` and ``Worker.poll``.
    """
    worker: Worker[Any] = Worker(job, limits)
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
