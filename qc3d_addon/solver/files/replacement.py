# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Replacing one file by another: whether it is allowed, which attributes are kept, and how it is undone."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import sys
import time as clock
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from ..errors import InputError

NO_FILE = "{} is a device, a pipe or a socket, which is never written to; give the name of a file."
_LONGEST_WAIT = 2.0  # seconds that another process may take to put several files in their places


def require_replaceable(path: Path, target: Path) -> None:
    """Refuse to replace what is not an ordinary file or is write-protected.

    The system itself would allow more: whoever may write in a folder may replace protected files there.

    Parameters
    ----------
    path : Path
        The file as the user named it, for error messages.
    target : Path
        The same with links resolved; it need not exist.

    Raises
    ------
    InputError
        If the target exists and is not an ordinary file.
    OSError
        If the file is write-protected or must not be replaced.
    """
    if not os.path.lexists(target):
        return
    found, folder = target.lstat(), target.parent.stat()
    if not stat.S_ISREG(found.st_mode):
        raise InputError(NO_FILE.format(path))
    if not os.access(target, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    # In shared folders such as /tmp, only the owner may replace a file.
    is_shared = folder.st_mode & stat.S_ISVTX
    if is_shared and hasattr(os, "geteuid") and os.geteuid() not in (0, found.st_uid, folder.st_uid):
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))


def inherit(new: Path, target: Path) -> None:
    """Give a new file the mode, owner and access lists of the file that it will replace, as far as allowed."""
    if not target.exists():
        return
    found = target.stat()
    mode = stat.S_IMODE(found.st_mode) & 0o777
    if hasattr(os, "chown"):
        for owner, group in ((-1, found.st_gid), (found.st_uid, -1)):
            with suppress(OSError):
                os.chown(new, owner, group)
        if new.stat().st_gid != found.st_gid:
            mode &= ~0o070 | (mode & 0o007) << 3  # a different group gets no more rights than everybody
    with suppress(OSError):  # not every file system has modes
        new.chmod(mode)
    if sys.platform == "linux":
        with suppress(OSError):
            for name in os.listxattr(target):
                with suppress(OSError):  # only the system may set some of them
                    os.setxattr(new, name, os.getxattr(target, name))


def set_aside(target: Path, folder: Path) -> Path | None:
    """Keep the present file, if there is one, under another name in ``folder``; return that name."""
    if not target.exists():
        return None
    kept = folder / "earlier"
    try:
        os.link(target, kept)
    except OSError:  # not every file system has links
        shutil.copy2(target, kept)
    return kept


def put_back(target: Path, kept: Path | None, new: os.stat_result) -> None:
    """Undo a replacement, whether or not it took place: restore the kept file, or remove the new one."""
    if kept is not None:
        kept.replace(target)
    elif target.exists() and os.path.samestat(target.stat(), new):
        target.unlink()


@contextmanager
def alone_in(folders: Iterable[Path]) -> Iterator[None]:
    """Wait, for a short time and where locks exist, until no other process replaces files in these folders."""
    with ExitStack() as stack:
        if sys.platform != "win32":
            import fcntl

            deadline = clock.monotonic() + _LONGEST_WAIT
            for folder in sorted(folders):
                with suppress(OSError):  # some folders cannot be opened, some file systems have no locks
                    opened = os.open(folder, os.O_RDONLY)
                    stack.callback(os.close, opened)
                    while clock.monotonic() < deadline:
                        try:
                            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
                            break
                        except BlockingIOError:
                            clock.sleep(0.01)
        yield
