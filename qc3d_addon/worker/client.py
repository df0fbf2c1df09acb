# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a task in a child process: reports progress, can stop it, and turns every kind of failure into a typed error."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import threading
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..solver import errors
from ..solver.errors import InputError, QC3DError, WorkerError, with_remedy
from ..solver.files.private_folders import PrivateFolder, temporary_place
from ..solver.frames.task import Outcome, Task
from ..solver.support.child_python import interpreter
from ..solver.support.progress import STAGES, Progress
from .exchange import read_outcome, write_task
from .idleness import LONGEST_IDLE, Idleness

CHILD = Path(__file__).with_name("task_child.py")
_LIBRARIES = ("scipy", "pytetwild", "numpy")  # numpy last: its folder may contain another scipy than the bundled one
_POLL_SECONDS = 0.05  # short beside any work, and long enough to take no processor time
_LONGEST_MESSAGE = 1_000_000  # bytes; more without an end is not a message of ours


@dataclass(frozen=True)
class Limits:
    """Limits of a child process.

    Parameters
    ----------
    seconds : float
        Time after which it is stopped.
    memory_mb : int
        Megabytes that it may allocate; 0 for no limit. Enforced on Linux only.
    """

    seconds: float = 3600.0
    memory_mb: int = 0


class Worker:
    """A task that runs in a child process. Use it from one thread only, and always call ``close`` at the end.

    Parameters
    ----------
    task : Task
        What to compute.
    limits : Limits, optional

    Raises
    ------
    InputError
        If the task needs more memory than its limit.
    WorkerError
        If the child process cannot be started.
    """

    def __init__(self, task: Task, limits: Limits | None = None) -> None:
        self._task = task
        self._limits = limits or Limits()
        task.require_memory(self._limits.memory_mb)
        self._progress: Progress | None = None
        self._ending: list[str] | None = None  # empty after success, else the type of the error and its message
        self._is_garbled = False
        self._is_closed = False
        try:
            self._folder = PrivateFolder()
        except OSError as error:
            raise _not_started(error) from error
        self._errors = self._folder.path / "errors.txt"
        try:
            write_task(self._folder.path, task)
            self._process = self._start()
        except OSError as error:
            self._folder.close()
            raise _not_started(error) from error
        except BaseException:
            self._folder.close()
            raise
        self._idleness = Idleness(self._process.pid)
        self._deadline = clock.monotonic() + self._limits.seconds
        self._reader = threading.Thread(target=self._read_messages, daemon=True)
        self._reader.start()

    @property
    def progress(self) -> Progress | None:
        """The latest progress; None before the first report."""
        return self._progress

    def poll(self) -> Outcome | None:
        """The outcome of the task, or None while it is running.

        Raises
        ------
        QC3DError
            The error that ended the work; a WorkerError if the process crashed or exceeded its limits.
        """
        if self._process.poll() is None:
            if self._is_garbled:
                self.close()
                raise WorkerError(_GARBLED)
            if self._idleness.lasts_too_long:
                self.close()
                raise WorkerError(_HANGS.format(LONGEST_IDLE))
            if clock.monotonic() > self._deadline:
                self.close()
                raise WorkerError(
                    f"The work was stopped after its time limit of {self._limits.seconds:g} s; raise the limit in the "
                    "add-on's preferences, or choose a lower quality."
                )
            return None
        _kill(self._process)  # processes that the child started may outlive it and keep the pipe open
        self._reader.join()
        try:
            return self._result()
        finally:
            self.close()

    def close(self) -> None:
        """Stop the child if it is still running, and remove its files. Calling it again does nothing."""
        if self._is_closed:
            return
        self._is_closed = True
        _kill(self._process)
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
        command = [python, "-I", "-S", CHILD, package, self._folder.path, memory, *_library_folders()]
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
            message = _message(text)
        except (ValueError, TypeError, RecursionError):
            self._is_garbled = True
            return
        if isinstance(message, Progress):
            self._progress = message
        else:
            self._ending = message

    def _result(self) -> Outcome:
        ending, status = self._ending, self._process.returncode
        if self._is_garbled:
            raise WorkerError(_GARBLED)
        if ending:
            kind, sentence = ending
            if kind == MemoryError.__name__:
                raise WorkerError(_out_of_memory(self._limits))
            known = getattr(errors, kind, None)
            if isinstance(known, type) and issubclass(known, QC3DError):
                raise known(sentence)
            raise WorkerError(sentence)
        if ending is None or status != 0:
            raise WorkerError(_how_it_ended(status, self._errors))
        try:
            return read_outcome(self._folder.path, self._task)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError) as error:
            raise WorkerError(f"The result of the work cannot be read: {error}; run it again.") from error


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


def _message(text: bytes) -> Progress | list[str]:
    """Parse a message of the child: progress, or how the work ended; ValueError or TypeError if it is neither."""
    message = json.loads(text)
    if message == {"done": True}:
        return []
    if set(message) == {"progress"}:
        stage, fraction, fit, fits = message["progress"]
        if stage in STAGES and 0.0 <= fraction <= 1.0 and type(fit) is type(fits) is int and 0 <= fit <= fits:
            return Progress(stage, float(fraction), fit, fits)
    elif set(message) == {"error"}:
        kind, sentence = message["error"]
        if isinstance(kind, str) and isinstance(sentence, str):
            return [kind, sentence]
    raise ValueError("not a message")


def run(task: Task, on_progress: Callable[[Progress], None] | None = None, limits: Limits | None = None) -> Outcome:
    """Carry out a task in a child process and wait for its outcome.

    Raises
    ------
    QC3DError
        As ``Worker`` and ``Worker.poll``.
    """
    worker = Worker(task, limits)
    shown = None
    try:
        while True:
            outcome = worker.poll()
            if on_progress is not None and worker.progress is not None and worker.progress != shown:
                shown = worker.progress
                on_progress(shown)
            if outcome is not None:
                return outcome
            clock.sleep(_POLL_SECONDS)
    finally:
        worker.close()


def _library_folders() -> list[Path]:
    """The folders that contain the libraries, found without importing them."""
    folders = []
    for name in _LIBRARIES:
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.origin is not None:
            folders.append(Path(spec.origin).resolve().parent.parent)
        elif name != "pytetwild":
            raise InputError(f"{name} is not installed for this Python; install the extension again.")
    return list(dict.fromkeys(folders))


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End the child and all processes that it started, which may outlive it."""
    if sys.platform != "win32":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    elif process.poll() is None:
        # By its full path: Windows would search the working folder first.
        taskkill = Path(os.environ.get("SYSTEMROOT", r"C:\Windows"), "System32", "taskkill.exe")
        subprocess.run([taskkill, "/T", "/F", "/PID", str(process.pid)], capture_output=True, check=False)
        process.kill()
    process.wait()


def _how_it_ended(status: int, errors_file: Path) -> str:
    text = errors_file.read_text(encoding="utf-8", errors="replace") if errors_file.exists() else ""
    lines = text.strip().splitlines()
    if status < 0:
        name = signal.Signals(-status).name if -status in set(signal.Signals) else f"signal {-status}"
        reason = "; memory may have run out" if -status == signal.SIGKILL else ""
        how = f"was ended by {name}{reason}"
    else:
        how = f"ended without a result (exit status {status})"
    last = f" Its last message: {lines[-1][:300]}" if lines else ""
    advice = "nothing was changed. Try again, with a lower quality if need be."
    return f"The background process {how}; {advice}{last}"
