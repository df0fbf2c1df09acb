# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a program in a temporary folder and leaves nothing behind, even if this process is killed."""

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
_PATIENCE = 10.0  # seconds that the guardian may take to kill the program and remove the folder


class Ending(NamedTuple):
    """How a program ended.

    Parameters
    ----------
    status : int or None
        Its exit status; None if it was stopped after its time limit.
    words : str
        The last line that it wrote to standard error.
    """

    status: int | None
    words: str


# By default the guardian has a process group of its own: a signal that ends the whole group of this process must not
# end the guardian, which still has to clean up.
_in_own_group = True


def share_group() -> None:
    """Start guardians in the process group of this process, because another process ends the group and cleans up."""
    global _in_own_group
    _in_own_group = False


class Guardian:
    """A helper process that runs one program. When this process ends, it kills the program and removes the folder.

    Use it in a ``with`` block; leaving the block does the same.

    Parameters
    ----------
    folder : Path
        The program's working folder.

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
        """Run a program to its end, but for at most ``seconds``. Call it once for each guardian.

        Raises
        ------
        OSError
            If the guardian itself was killed.
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
        """Stop the program, if it still runs, and remove the folder."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            status = self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            status = None
        self._process.stdout.close()
        if status != 0:  # the guardian was killed or hangs, so the program may still be running
            self._kill()

    def _kill(self) -> None:
        if sys.platform != "win32" and _in_own_group:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        self._process.wait()
