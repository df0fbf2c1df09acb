# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In a child process: what the process that started it says, and the end when that is gone."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable
from typing import NoReturn


def listen(on_line: Callable[[bytes], object], clear_up: Callable[[], object]) -> None:
    """Read standard input in a thread, and end this process when it closes: then the parent is gone.

    Parameters
    ----------
    on_line
        Called with each line that the parent sends.
    clear_up
        Called before the end.
    """
    threading.Thread(target=_listen, args=(on_line, clear_up), daemon=True).start()


def leave(clear_up: Callable[[], object]) -> NoReturn:
    """Clean up and end this process and all that it started."""
    clear_up()
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(os.getpid(), signal.SIGKILL)
    os._exit(1)


def _listen(on_line: Callable[[bytes], object], clear_up: Callable[[], object]) -> NoReturn:
    rest = b""
    with contextlib.suppress(OSError):
        while chunk := os.read(0, 4096):
            *whole, rest = (rest + chunk).split(b"\n")
            for line in whole:
                on_line(line)
    leave(clear_up)
