# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders that only this process uses: gone when it is done with them, swept by a later one where it was killed."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import stat
import sys
import tempfile
import time as clock
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

PREFIX = ".qc3d-"
_MARK = "in_use"
_SENTENCE = "QC3D removes this folder, and all that is in it, once the program that made it has ended.\n"
_YOUNG = 60.0  # seconds in which a folder may still be in the making
_BESIDE = re.compile(r"\.qc3d-[0-9a-f]{32}(\.\w{1,50})?")
_LONGEST_MARK = 10_000  # bytes


class PrivateFolder:
    """A new folder that only this user can enter, removed by ``close``; on Windows whoever may enter ``parent`` can.

    Its name proves that it was made here, by this user, in this place: no other folder, no copy and no folder that was
    moved has such a name. A file in it, the mark, is locked while the folder is in use. The system frees the lock when
    the process ends, however that happens; every new folder first removes those beside it that nobody uses any more.

    Parameters
    ----------
    parent : Path, optional
        Where it is made; by default in the system's folder for temporary files.

    Attributes
    ----------
    path : Path

    Raises
    ------
    OSError
        If no folder can be made.
    """

    def __init__(self, parent: Path | None = None) -> None:
        is_temporary = parent is None
        parent = Path(tempfile.gettempdir()) if parent is None else parent
        remove_abandoned(parent)
        start = f"{PREFIX}{secrets.token_hex(8)}"
        self.path = Path(os.path.abspath(parent)) / f"{start}{_proof(start, parent)}"
        # On Windows a file keeps the access rights of the folder that it was made in when it is moved elsewhere.
        self.path.mkdir(0o777 if sys.platform == "win32" and not is_temporary else 0o700)
        self._mark: BinaryIO | None = None
        try:
            self._mark = (self.path / _MARK).open("x+b", buffering=0)
            _lock(self._mark)  # before it says anything: whoever finds the sentence unlocked may remove the folder
            _write_whole(self._mark, _SENTENCE)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def beside(self, suffix: str) -> Path:
        """A name that nobody can guess for a file next to the folder, removed with it.

        For files that have to be written in the place where they will stay. There is no such file yet.
        """
        assert self._mark is not None
        name = f"{PREFIX}{secrets.token_hex(16)}"
        name += suffix if _BESIDE.fullmatch(name + suffix) else ""
        _write_whole(self._mark, f"{name}\n")
        return self.path.with_name(name)

    def close(self) -> None:
        """Remove the folder and all in it; nothing happens the second time."""
        mark, self._mark = self._mark, None
        remove(self.path, mark)


def temporary_place() -> str:
    """Where temporary files go, for a sentence."""
    try:
        return tempfile.gettempdir()
    except OSError:  # no folder that would do was found
        return "any of the places for them"


def remove(folder: Path, mark: BinaryIO | None = None) -> None:
    """Remove a private folder, its mark last, so that a later sweep finds what could not be removed.

    Parameters
    ----------
    folder : Path
    mark : BinaryIO, optional
        The open mark, which is closed; what it names beside the folder goes as well.
    """
    left = [path for path in _siblings(folder, mark) if not _remove(path)]
    if mark is not None:
        mark.close()  # before a folder is opened: there may be no more files than this that may be open
    with suppress(OSError):
        left += [path for path in folder.iterdir() if path.name != _MARK and not _remove(path)]
    if not left and _remove(folder / _MARK):
        with suppress(OSError):
            folder.rmdir()


def remove_abandoned(parent: Path) -> None:
    """Remove private folders in ``parent`` whose processes ended without doing so; what cannot be removed stays."""
    with suppress(OSError), os.scandir(parent) as entries:
        found = [Path(entry.path) for entry in entries if entry.name.startswith(PREFIX)]
        for folder in found:
            with suppress(OSError):
                _remove_if_abandoned(folder)


def _remove_if_abandoned(folder: Path) -> None:
    found = folder.lstat()  # not what a symbolic link leads to
    if not (_is_ours(found, stat.S_ISDIR) and folder.name == _proven(folder)):
        return
    is_old = clock.time() - found.st_mtime > _YOUNG
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    try:
        opened = os.open(folder / _MARK, flags)
    except FileNotFoundError:  # killed as it made the folder; what has anything in it stays
        if is_old:
            folder.rmdir()
        return
    with open(opened, "r+b", buffering=0) as mark:
        if not _is_ours(os.fstat(opened), stat.S_ISREG):
            return
        said = mark.read(len(_SENTENCE)).decode("utf-8", errors="replace")
        is_half_made = is_old and _SENTENCE.startswith(said) and os.listdir(folder) == [_MARK]
        if (said == _SENTENCE or is_half_made) and _lock(mark):
            remove(folder, mark)


def _proof(start: str, parent: Path) -> str:
    """What the name of a private folder that begins so ends with, for this user in this place."""
    user = os.geteuid() if hasattr(os, "geteuid") else 0
    return hashlib.sha256(f"{start} {user} {parent.stat().st_ino}".encode()).hexdigest()[:16]


def _proven(folder: Path) -> str:
    """The only name that begins as that of ``folder`` does and that this user's private folders have there."""
    start = folder.name[: len(PREFIX) + 16]
    return f"{start}{_proof(start, folder.parent)}"


def _is_ours(found: os.stat_result, is_kind: Callable[[int], bool]) -> bool:
    return is_kind(found.st_mode) and (not hasattr(os, "geteuid") or found.st_uid == os.geteuid())


def _write_whole(mark: BinaryIO, text: str) -> None:
    data = text.encode()
    while data:
        data = data[mark.write(data) :]  # what finds no room the first time is refused the second time


def _siblings(folder: Path, mark: BinaryIO | None) -> list[Path]:
    """The files beside a folder that belong to it, as its mark says, and what Blender calls them as it writes."""
    if mark is None:
        return []
    mark.seek(0)
    whole_lines = mark.read(_LONGEST_MARK).decode("utf-8", errors="replace").split("\n")[1:-1]
    return [folder.with_name(name + end) for name in whole_lines if _BESIDE.fullmatch(name) for end in ("", "@")]


def _remove(path: Path) -> bool:
    """Remove a file, or a folder with all in it; whether it is gone."""
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    return not os.path.lexists(path)


def _lock(file: BinaryIO) -> bool:
    """Lock a file until it is closed; False where another one holds its lock, or the file system has no locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            file.seek(_LONGEST_MARK)  # behind the end: a byte that is locked could not be read by others
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            file.seek(0)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
