# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A child process that carries out jobs, one after the other, seen from the process that starts it."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import threading
import time as clock
from pathlib import Path

from ..solver.errors import WorkerError
from ..solver.files.private_folders import PrivateFolder
from ..solver.support.child_python import interpreter
from .messages import Inbox
from .processes import how_it_ended, kill, library_folders

PACKAGE = Path(__file__).resolve().parent.parent
CHILD = Path(__file__).with_name("task_child.py")
_LONGEST_MESSAGE = 1_000_000  # bytes; more without an end is not a message of ours

Code = frozenset[tuple[str, int, int]]


class Child:
    """A child process with a folder of its own, from which it takes its jobs.

    Use it from one thread, and call ``close`` at the end. If this process ends first, the child removes the folder and
    ends as well.

    Parameters
    ----------
    stay : float
        Seconds that it waits for another job after each; 0 for a child that ends after its first.

    Attributes
    ----------
    process : subprocess.Popen
    inbox : Inbox
        What it has said about its present job.
    code : frozenset
        The files of the package that it was started from, see ``code_now``.

    Raises
    ------
    OSError, WorkerError
        If it cannot be started.
    """

    def __init__(self, stay: float = 0.0) -> None:
        self.code = code_now()
        self.inbox = Inbox()
        self.idle_since = clock.monotonic()
        self._folder = PrivateFolder()
        self._errors = self._folder.path / "errors.txt"
        self._said_before = 0
        try:
            self.process = self._start(stay)
        except BaseException:
            self._folder.close()
            raise
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def job(self) -> Path:
        """The folder of its present job."""
        return self._folder.path / "job"

    def take_new_job(self) -> Path:
        """Make a new folder for the next job, and forget what was said about the one before."""
        self.inbox = Inbox()
        self._said_before = self._errors.stat().st_size
        self.job.mkdir(mode=0o700)
        return self.job

    def begin(self, memory: int) -> bool:
        """Let it begin the job in its folder, with ``memory`` more bytes at most, 0 for any number.

        Returns whether it could be told; if not, it has ended.
        """
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps({"memory": memory}).encode() + b"\n")
            self.process.stdin.flush()
        except OSError:
            return False
        return True

    def put_away(self) -> bool:
        """Remove the folder of a job that has ended; returns whether it is gone, so that another job can come."""
        shutil.rmtree(self.job, ignore_errors=True)
        self.idle_since = clock.monotonic()
        return not self.job.exists()

    def has_ended(self) -> bool:
        """Whether it has ended; what it had started has then ended as well, and all that it said is in the inbox."""
        if self.process.poll() is None:
            return False
        self._end()
        return True

    def how_it_ended(self) -> str:
        """A sentence about a child that has ended without a result."""
        return how_it_ended(self.process.returncode, self._errors, self._said_before)

    def close(self) -> None:
        """End it if it is still running, and remove its files. Calling it again does nothing."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._end()
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        self.process.stdout.close()
        self._folder.close()

    def _start(self, stay: float) -> subprocess.Popen[bytes]:
        python = interpreter()
        if python is None:
            raise WorkerError(
                "No Python interpreter was found for the background process; install Blender with its own Python."
            )
        # Without the interpreter's own packages: the child must use the same libraries as this process.
        command = [python, "-I", "-S", CHILD, PACKAGE, self._folder.path, stay, *library_folders()]
        flags = 0
        if sys.platform == "win32":
            flags = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP
            flags |= subprocess.BELOW_NORMAL_PRIORITY_CLASS  # the window that the user works in comes first
        with open(self._errors, "wb") as stream:
            return subprocess.Popen(
                [str(part) for part in command],
                stdin=subprocess.PIPE,  # when it closes, the child knows that this process is gone
                stdout=subprocess.PIPE,
                stderr=stream,
                creationflags=flags,
                start_new_session=sys.platform != "win32",
            )

    def _read(self) -> None:
        """Hand on messages until the child closes the pipe; a child that ended by itself is then no zombie."""
        stream = self.process.stdout
        assert stream is not None
        rest = b""
        while chunk := os.read(stream.fileno(), 65536):
            if self.inbox.is_garbled:
                rest = b""
                continue  # keep reading: a child that cannot write would never end
            *whole, rest = (rest + chunk).split(b"\0")
            for text in whole:
                self.inbox.take(text)
            self.inbox.is_garbled |= len(rest) > _LONGEST_MESSAGE
        self.process.wait()
        kill(self.process)  # the processes that it started

    def _end(self) -> None:
        """End it with all that it started. What has ended long ago is left alone: others may have its number now."""
        if self._reader.is_alive():  # also where what the child started keeps the pipe open
            kill(self.process)
            self._reader.join()


def code_now() -> Code:
    """The files of this package with their sizes and times: whatever was started from others is out of date."""
    found = []
    for folder, _, files in os.walk(PACKAGE):
        for name in files:
            if name.endswith(".py"):
                path = os.path.join(folder, name)
                with contextlib.suppress(OSError):  # removed in this moment
                    state = os.stat(path)
                    found.append((path, state.st_size, state.st_mtime_ns))
    return frozenset(found)
