# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Locks on open files, which the system releases when the process ends, however that happens."""

from __future__ import annotations

import errno
import sys
from typing import BinaryIO

_HELD = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)


def lock(file: BinaryIO, at: int = 0) -> bool:
    """Lock a file until it is closed, without waiting.

    Parameters
    ----------
    file : binary file
        Open for writing.
    at : int
        The byte that is locked on Windows, where others cannot read it meanwhile; it may be beyond the end.

    Returns
    -------
    bool
        False if another process has locked it.

    Raises
    ------
    OSError
        If the file system has no locks.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            place = file.tell()
            file.seek(at)
            try:
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            finally:
                file.seek(place)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _HELD:
            return False
        raise
    return True
