# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Temporary folders of which nothing stays, not even where the process that made them was killed."""

from __future__ import annotations

import os
import shutil
import stat
import sys
import tempfile
import time as clock
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

PREFIX = "qc3d-"
_MARK = "in_use"
_YOUNG = 60.0  # seconds in which a folder may still be in the making


class PrivateFolder:
    """A new folder that only this user can read, removed by ``close``.

    While it is in use a file in it is locked. The system frees the lock when the process ends, however that happens:
    every new folder first removes those that nobody uses any more.

    Attributes
    ----------
    path : Path

    Raises
    ------
    OSError
        If no folder can be made.
    """

    def __init__(self) -> None:
        remove_abandoned()
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        try:
            self._mark = (self.path / _MARK).open("wb")
            _lock(self._mark)
        except OSError:
            shutil.rmtree(self.path, ignore_errors=True)
            raise

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder and all in it; nothing happens the second time."""
        self._mark.close()
        shutil.rmtree(self.path, ignore_errors=True)


def remove_abandoned() -> None:
    """Remove folders of processes that ended without removing them; what cannot be removed stays."""
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            if _is_abandoned(folder):
                shutil.rmtree(folder, ignore_errors=True)


def _is_abandoned(folder: Path) -> bool:
    found = folder.lstat()  # not what a symbolic link leads to
    if not stat.S_ISDIR(found.st_mode) or (hasattr(os, "getuid") and found.st_uid != os.getuid()):
        return False
    if clock.time() - found.st_mtime < _YOUNG:
        return False
    mark = folder / _MARK
    if not mark.exists():
        return not any(folder.iterdir())
    with mark.open("r+b") as file:
        return _lock(file)


def _lock(file: BinaryIO) -> bool:
    """Lock a file until it is closed; False where another one holds its lock."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
