# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a program in a folder; kills it and removes the folder as soon as the parent process is gone.

This is a separate process because the program may be unable to watch its parent: fTetWild holds the GIL while it
works. It is started by :mod:`.guarded_program`, which also defines the request and the answer::

    python -I -S guardian.py FOLDER

Standard input closes when the parent ends, however that happens, or when it has no further use for the program. Then
the program is killed, FOLDER is removed, and this process ends.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
from contextlib import suppress

_LAST_WORDS = 300  # characters


def main(folder: str) -> None:
    """Carry out at most one request, then wait until standard input closes, and remove the folder."""
    request = sys.stdin.buffer.readline()
    if request.endswith(b"\n"):
        asked = json.loads(request)
        answer, watcher = _carry_out(folder, asked["command"], asked["seconds"])
        with suppress(BrokenPipeError):
            sys.stdout.write(json.dumps(answer) + "\n")
            sys.stdout.flush()
        watcher.join()
    shutil.rmtree(folder, ignore_errors=True)


def _carry_out(folder: str, command: list[str], seconds: float) -> tuple[dict[str, int | str | None], threading.Thread]:
    """Run the program; return how it ended, and the thread that waits for the parent to go.

    The status is None if the program was stopped after ``seconds``; the words are its last line on standard error.
    """
    running: list[subprocess.Popen[bytes]] = []
    watcher = threading.Thread(target=_kill_when_nobody_is_there, args=(running,))
    try:
        running += [_start(command, folder)]
    except OSError as error:
        watcher.start()
        return {"status": 1, "words": error.strerror or str(error)}, watcher
    watcher.start()
    try:
        written = running[0].communicate(timeout=seconds)[1]
        status: int | None = running[0].returncode
    except subprocess.TimeoutExpired:
        running[0].kill()
        written, status = running[0].communicate()[1], None
    lines = written.decode("utf-8", errors="replace").strip().splitlines()
    return {"status": status, "words": lines[-1][:_LAST_WORDS] if lines else ""}, watcher


def _start(command: list[str], folder: str) -> subprocess.Popen[bytes]:
    flags = 0
    if sys.platform == "win32":
        flags = subprocess.CREATE_NO_WINDOW
    return subprocess.Popen(
        command,
        cwd=folder,  # fTetWild writes files of its own into the working folder
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        creationflags=flags,
    )


def _kill_when_nobody_is_there(running: list[subprocess.Popen[bytes]]) -> None:
    while sys.stdin.buffer.read(4096):
        pass
    for process in running:
        process.kill()


if __name__ == "__main__":
    main(sys.argv[1])
