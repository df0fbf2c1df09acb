# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders that only this process uses; if it is killed before it removes one, a later process does."""

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

from .locks import lock

PREFIX = ".qc3d-"
_MARK = "in_use"
_SENTENCE = "QC3D removes this folder, and all that is in it, once the program that made it has ended.\n"
_YOUNG = 60.0  # seconds in which a folder may still be in the making
_BESIDE = re.compile(r"\.qc3d-[0-9a-f]{32}(\.\w{1,50})?")
_LONGEST_MARK = 10_000  # bytes


class PrivateFolder:
    """A new folder that only this user can enter, removed by ``close``. On Windows, its access is that of ``parent``.

    Its name proves that this user made it in this place: no other folder, no copy and no moved folder has such a name.
    A file in it, the mark, is locked while the folder is in use. The system releases the lock when the process ends,
    however that happens, and making a new folder first removes abandoned ones next to it.

    Parameters
    ----------
    parent : Path, optional
        Where the folder is made; by default in the system's folder for temporary files.

    Attributes
    ----------
    path : Path
        The folder.

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
        # On Windows, a file that is moved keeps the access rights of the folder in which it was made.
        self.path.mkdir(0o777 if sys.platform == "win32" and not is_temporary else 0o700)
        self._mark: BinaryIO | None = None
        try:
            self._mark = (self.path / _MARK).open("x+b", buffering=0)
            _lock(self._mark)  # before writing: a sweep removes folders whose mark has the sentence but no lock
            _write_whole(self._mark, _SENTENCE)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def beside(self, suffix: str) -> Path:
        """An unguessable name for a file next to the folder, which is removed together with it.

        For files that must be written in their final folder. No file of that name exists yet.
        """
        assert self._mark is not None
        name = f"{PREFIX}{secrets.token_hex(16)}"
        name += suffix if _BESIDE.fullmatch(name + suffix) else ""
        _write_whole(self._mark, f"{name}\n")
        return self.path.with_name(name)

    def close(self) -> None:
        """Remove the folder and its contents. Calling it again does nothing."""
        mark, self._mark = self._mark, None
        remove(self.path, mark)


def temporary_place() -> str:
    """The folder for temporary files, for error messages."""
    try:
        return tempfile.gettempdir()
    except OSError:  # no folder that would do was found
        return "any of the places for them"


def remove(folder: Path, mark: BinaryIO | None = None) -> None:
    """Remove a private folder, its mark last, so that a later sweep finds whatever could not be removed.

    Parameters
    ----------
    folder : Path
    mark : BinaryIO, optional
        The open mark, which is closed; the files next to the folder that it lists are removed as well.
    """
    left = [path for path in _siblings(folder, mark) if not _remove(path)]
    if mark is not None:
        mark.close()  # before listing the folder: the limit of open files may be reached
    with suppress(OSError):
        left += [path for path in folder.iterdir() if path.name != _MARK and not _remove(path)]
    if not left and _remove(folder / _MARK):
        with suppress(OSError):
            folder.rmdir()


def remove_abandoned(parent: Path) -> None:
    """Remove the private folders in ``parent`` that ended processes left behind; what cannot be removed stays."""
    with suppress(OSError), os.scandir(parent) as entries:
        found = [Path(entry.path) for entry in entries if entry.name.startswith(PREFIX)]
        for folder in found:
            with suppress(OSError):
                _remove_if_abandoned(folder)


def _remove_if_abandoned(folder: Path) -> None:
    found = folder.lstat()  # does not follow symbolic links
    if not (_is_ours(found, stat.S_ISDIR) and folder.name == _proven(folder)):
        return
    is_old = clock.time() - found.st_mtime > _YOUNG
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    try:
        opened = os.open(folder / _MARK, flags)
    except FileNotFoundError:  # its process was killed while making it; rmdir keeps a folder that is not empty
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
    """The second half of a private folder's name, which depends on the first, the user and the parent folder."""
    user = os.geteuid() if hasattr(os, "geteuid") else 0
    return hashlib.sha256(f"{start} {user} {parent.stat().st_ino}".encode()).hexdigest()[:16]


def _proven(folder: Path) -> str:
    """The only valid name of this user's private folder that begins like the name of ``folder``."""
    start = folder.name[: len(PREFIX) + 16]
    return f"{start}{_proof(start, folder.parent)}"


def _is_ours(found: os.stat_result, is_kind: Callable[[int], bool]) -> bool:
    return is_kind(found.st_mode) and (not hasattr(os, "geteuid") or found.st_uid == os.geteuid())


def _write_whole(mark: BinaryIO, text: str) -> None:
    data = text.encode()
    while data:
        data = data[mark.write(data) :]  # a short write on a full disk is followed by an error


def _siblings(folder: Path, mark: BinaryIO | None) -> list[Path]:
    """The files next to a folder that its mark lists, and the names that Blender gives them while it writes."""
    if mark is None:
        return []
    mark.seek(0)
    whole_lines = mark.read(_LONGEST_MARK).decode("utf-8", errors="replace").split("\n")[1:-1]
    return [folder.with_name(name + end) for name in whole_lines if _BESIDE.fullmatch(name) for end in ("", "@")]


def _remove(path: Path) -> bool:
    """Remove a file, or a folder with its contents; return whether it is gone."""
    with suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    return not os.path.lexists(path)


def _lock(file: BinaryIO) -> bool:
    """Lock a file until it is closed; return False if it is locked already, or if the file system has no locks."""
    try:
        return lock(file, at=_LONGEST_MARK)  # beyond the end: others cannot read a locked byte
    except OSError:
        return False
