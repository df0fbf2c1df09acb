# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes: where they find their libraries, how they are ended, and how they ended by themselves."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import subprocess
import sys
from pathlib import Path

from ..solver.errors import InputError

_LIBRARIES = ("scipy", "pytetwild", "numpy")  # numpy last: its folder may contain another scipy than the bundled one


def library_folders() -> list[Path]:
    """The folders that contain the libraries, found without importing them."""
    folders = []
    for name in _LIBRARIES:
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.origin is not None:
            folders.append(Path(spec.origin).resolve().parent.parent)
        elif name != "pytetwild":
            raise InputError(f"{name} is not installed for this Python; install the extension again.")
    return list(dict.fromkeys(folders))


def kill(process: subprocess.Popen[bytes]) -> None:
    """End the child and all processes that it started, which may outlive it."""
    if sys.platform != "win32":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    elif process.poll() is None:
        # By its full path: Windows would search the working folder first.
        taskkill = Path(os.environ.get("SYSTEMROOT", r"C:\Windows"), "System32", "taskkill.exe")
        subprocess.run([taskkill, "/T", "/F", "/PID", str(process.pid)], capture_output=True, check=False)
        process.kill()
    process.wait()


def how_it_ended(status: int, errors_file: Path, since: int = 0) -> str:
    """A sentence about a child that ended without a result; its last message is in the file of its errors.

    Only what follows the first ``since`` bytes of the file counts.
    """
    text = errors_file.read_bytes()[since:].decode(errors="replace") if errors_file.exists() else ""
    lines = text.strip().splitlines()
    if status < 0:
        name = signal.Signals(-status).name if -status in set(signal.Signals) else f"signal {-status}"
        reason = "; memory may have run out" if -status == signal.SIGKILL else ""
        how = f"was ended by {name}{reason}"
    else:
        how = f"ended without a result (exit status {status})"
    last = f" Its last message: {lines[-1][:300]}" if lines else ""
    advice = "nothing was changed. Try again, with a lower quality if need be."
    return f"The background process {how}; {advice}{last}"
