# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where processes of our own begin, before numpy is loaded: the command ``qc3d``, and the child of the add-on."""

from __future__ import annotations

import os
import signal
import sys


def main() -> int:
    """Run the command ``qc3d``; see :func:`qc3d_addon.cli.main.main`. A request to end is treated as Ctrl-C is."""
    try:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        one_thread_each()
        from .cli.main import main as run  # loading the libraries takes a while, in which Ctrl-C may come
    except KeyboardInterrupt:
        print("qc3d: Interrupted; nothing was written.", file=sys.stderr)
        return 130
    return run()


def one_thread_each() -> None:
    """Let BLAS work in the thread that calls it, unless the user has said otherwise.

    Frames are made in threads of their own already; more threads inside each would only wait for one another.
    """
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(variable, "1")
