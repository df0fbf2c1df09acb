# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In a child process: its end when the process that started it is gone."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable
from typing import NoReturn


def end_with_it(clear_up: Callable[[], None], on_line: Callable[[], object] = lambda: None) -> None:
    """Watch standard input in a thread, and end this process when it closes.

    Parameters
    ----------
    clear_up
        Called before the end.
    on_line
        Called for each line that the parent sends.
    """
    threading.Thread(target=_watch, args=(clear_up, on_line), daemon=True).start()


def _watch(clear_up: Callable[[], None], on_line: Callable[[], object]) -> NoReturn:
    with contextlib.suppress(OSError):
        while words := os.read(0, 4096):
            for _ in range(words.count(b"\n")):
                on_line()
    clear_up()
    # The end of all that it started, too.
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(os.getpid(), signal.SIGKILL)
    os._exit(1)
