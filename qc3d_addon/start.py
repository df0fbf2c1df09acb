# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where processes of our own begin, before numpy is loaded: the command ``qc3d``, and the child of the add-on."""

from __future__ import annotations

import os
import signal

from .cli import speech

# The system or the user asks to end, the terminal is closed, Ctrl-\\, and Ctrl-Break.
_REQUESTS_TO_END = ("SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")


def main() -> int:
    """Run the command ``qc3d``; see :func:`qc3d_addon.cli.main.main`. A request to end is treated as Ctrl-C is."""
    try:
        speech.open_streams()
        for name in _REQUESTS_TO_END:
            number = getattr(signal, name, None)
            # What is ignored from the start stays so: nohup lets a command go on when the terminal is closed.
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, signal.default_int_handler)
        one_thread_each()
        try:
            from .cli.main import main as run  # loading the libraries takes a while, in which Ctrl-C may come
        except Exception as error:  # whatever a library of another Python, or another file of its name, does
            speech.note(_not_loaded(error))
            return 2
        return run()
    except KeyboardInterrupt:
        speech.note("Interrupted; nothing was written.")
        return 130


def one_thread_each() -> None:
    """Let BLAS work in the thread that calls it, unless the user has said otherwise.

    Frames are made in threads of their own already; more threads inside each would only wait for one another.
    """
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(variable, "1")


def _not_loaded(error: Exception) -> str:
    text = " ".join(f"{type(error).__name__}: {error}".split()).rstrip(".")[:500]
    path = os.environ.get("PYTHONPATH")
    remedy = f"unset PYTHONPATH, which is {path!r}, or install QC3D again" if path else "install QC3D again"
    return f"Its libraries do not load: {text}; {remedy}."
