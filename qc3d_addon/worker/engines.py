# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds out which meshing engine works on this machine, without loading anything into this process."""

from __future__ import annotations

import subprocess
import sys

from ..solver.meshing import tetwild_loading

_TAKES_OVER = "The engine delaunay is used here, because tetwild cannot run: {}."

_probe: subprocess.Popen[bytes] | None = None
_asked = False
_notice: str | None = None


def engine_notice() -> str | None:
    """A sentence for the user if tetwild does not work here and delaunay takes over; None if it works.

    Fast enough for a panel's drawing: the first call starts a child process that only loads fTetWild, which is the only
    way to detect a wheel made for a newer system. Later calls check whether it has ended; until then, the answer is
    None.
    """
    global _asked, _notice, _probe
    if not _asked:
        _asked = True
        reason = tetwild_loading.unavailable_reason()
        if reason is None:
            try:
                _probe = _start()
            except OSError as error:
                reason = f"no process can be started ({error})"
        if reason is not None:
            _notice = _TAKES_OVER.format(reason)
    if _probe is not None and _probe.poll() is not None:
        if _probe.returncode != 0:
            _notice = _TAKES_OVER.format("its compiled module does not load on this system")
        _probe = None
    return _notice


def forget() -> None:
    """Stop the child process if it is still running, and forget its answer; the next ``engine_notice`` starts anew."""
    global _asked, _notice, _probe
    if _probe is not None:
        _probe.kill()
        _probe.wait()
    _asked, _notice, _probe = False, None, None


def _start() -> subprocess.Popen[bytes]:
    nowhere = subprocess.DEVNULL
    flags = 0
    if sys.platform == "win32":
        flags = subprocess.CREATE_NO_WINDOW
    return subprocess.Popen(
        tetwild_loading.load_command(), stdin=nowhere, stdout=nowhere, stderr=nowhere, creationflags=flags
    )
