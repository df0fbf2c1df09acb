# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Start of our own processes, before numpy is loaded: the command ``qc3d``, and the add-on's child process."""

from __future__ import annotations

import os
import signal

from .cli import speech

# A request of the system or the user, a closed terminal, Ctrl-\\, and Ctrl-Break.
_REQUESTS_TO_END = ("SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")


def main() -> int:
    """Run the command ``qc3d``; see :func:`qc3d_addon.cli.main.main`. Requests to end are treated like Ctrl-C."""
    try:
        speech.open_streams()
        for name in _REQUESTS_TO_END:
            number = getattr(signal, name, None)
            # Signals that are ignored from the start stay ignored: nohup relies on that.
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, signal.default_int_handler)
        one_thread_each()
        try:
            from .cli.main import main as run  # takes a while, during which Ctrl-C may be pressed
        except Exception as error:  # a library for another Python, or another file with its name, may raise anything
            speech.note(_not_loaded(error))
            return 2
        return run()
    except KeyboardInterrupt:
        speech.note("Interrupted; nothing was written.")
        return 130


def one_thread_each() -> None:
    """Make BLAS compute in the calling thread, unless the user has chosen otherwise.

    Frames are computed in several threads already; more threads inside each would only wait for one another.
    """
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(variable, "1")


def _not_loaded(error: Exception) -> str:
    text = " ".join(f"{type(error).__name__}: {error}".split()).rstrip(".")[:500]
    path = os.environ.get("PYTHONPATH")
    remedy = f"unset PYTHONPATH, which is {path!r}, or install QC3D again" if path else "install QC3D again"
    return f"Its libraries do not load: {text}; {remedy}."
