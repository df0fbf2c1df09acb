# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A program at work in a temporary folder, of which nothing is left when this process ends or is killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

from .child_python import interpreter

GUARDIAN = Path(__file__).with_name("guardian.py")
_PATIENCE = 10.0  # seconds for the guardian to clear up


class Ending(NamedTuple):
    """How a program ended: its exit status, None where it took too long, and its last words on standard error."""

    status: int | None
    words: str


# What ends this process with all its group is not to end the guardian, unless somebody else clears up.
_in_own_group = True


def share_group() -> None:
    """Let guardians be in the group of this process, where another process ends the group and removes the folders."""
    global _in_own_group
    _in_own_group = False


class Guardian:
    """Another process that watches this one; when this one ends, it kills the program and removes the folder.

    It does so at the end of the ``with`` block too.

    Parameters
    ----------
    folder : Path
        Where the program works.

    Raises
    ------
    OSError
        If no process can be started.
    """

    def __init__(self, folder: Path) -> None:
        flags, group = 0, None
        if sys.platform == "win32":
            flags = subprocess.CREATE_NO_WINDOW | (subprocess.CREATE_NEW_PROCESS_GROUP if _in_own_group else 0)
        elif _in_own_group:
            group = 0
        self._process = subprocess.Popen(
            [str(interpreter()), "-I", "-S", str(GUARDIAN), str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            creationflags=flags,
            process_group=group,
        )

    def run(self, command: list[str], seconds: float) -> Ending:
        """Run a program to its end, or for so many seconds; once for each guardian.

        Raises
        ------
        OSError
            If the guardian was killed.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({"command": command, "seconds": seconds}).encode() + b"\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer.endswith(b"\n"):
            raise ChildProcessError("the process that watched it was killed")
        return Ending(**json.loads(answer))

    def __enter__(self) -> Guardian:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """End the program, if it still runs, and remove the folder."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            status = self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            status = None
        self._process.stdout.close()
        if status != 0:  # it was killed, or hangs: the program may still be there
            self._kill()

    def _kill(self) -> None:
        if sys.platform != "win32" and _in_own_group:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.wait()
