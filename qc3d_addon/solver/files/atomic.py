# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs, all of them: looked at before the work, written in private, and put in their places whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from ..errors import InputError, with_remedy
from .private_folders import PrivateFolder
from .replacement import NO_FILE, alone_in, inherit, put_back, require_replaceable, set_aside

_LONGEST_SUFFIX = 50  # characters; no format has a longer one


def require_writable(*paths: Path, inputs: Iterable[Path | None] = ()) -> None:
    """Check, before any work, that files can be written; nothing is left there.

    Parameters
    ----------
    paths : Path
        The files. A link is followed, as by other programs.
    inputs : iterable of Path or None, optional
        Files that are read and must stay as they are.

    Raises
    ------
    InputError
        If one is a folder, a device, a pipe or a socket, may not be written, or is named twice.
    """
    targets = _targets(paths, [path for path in inputs if path is not None])
    for path, target in zip(paths, targets, strict=True):
        with _as_input_error(path, _UNWRITTEN):
            PrivateFolder(target.parent).close()
            require_replaceable(path, target)


def require_writable_in(folder: Path, names: Iterable[str], inputs: Iterable[Path | None] = ()) -> None:
    """As ``require_writable`` for files in a folder that need not be there yet.

    Raises
    ------
    InputError
        As ``require_writable``, and if there is something else in the folder's place.
    """
    with _as_input_error(folder, _NO_FOLDER):
        missing = _missing(folder)
        if missing:
            PrivateFolder(missing[-1].parent).close()
        elif not folder.is_dir():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
    if not missing:
        require_writable(*(folder / name for name in names), inputs=inputs)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """As ``replacing_all`` for one file."""
    with replacing_all(path) as (new,):
        yield new


@contextmanager
def replacing_all(*paths: Path, beside: bool = False) -> Iterator[list[Path]]:
    """Give absolute names to write files to, which all take the places of ``paths`` when the block ends well.

    There are no files of these names yet, and nobody else can put any there. Leaving by an error removes what was
    written and keeps what was there; an OSError becomes one sentence. A file that is replaced keeps its mode and its
    access lists, and its owner where this user may give files away. Processes that replace several files in the same
    folder at the same time wait for each other, but not for long: that each file is whole matters more than that all
    are from the same process.

    Parameters
    ----------
    paths : Path
        The files. A link is followed, as by other programs.
    beside : bool
        Whether the new files are to lie in the folders where they will stay, for formats that name other files
        relative to their own place, such as .blend; else they are in folders of their own.

    Raises
    ------
    InputError
        As ``require_writable``, and if a file cannot be written or put in its place; nothing was written then.
    """
    targets = _targets(paths, ())
    with ExitStack() as stack:
        folders, new = [], []
        for path, target in zip(paths, targets, strict=True):
            with _as_input_error(path, _UNWRITTEN):
                require_replaceable(path, target)
                private = PrivateFolder(target.parent)
                folders.append(stack.enter_context(private))
                suffix = target.suffix[:_LONGEST_SUFFIX]
                new.append(private.beside(suffix) if beside else private.path / f"new{suffix}")
        with _as_input_error(" or ".join(map(str, paths)), _UNWRITTEN):
            yield new
        for path, file, folder in zip(paths, new, folders, strict=True):
            with _as_input_error(path, _UNWRITTEN):
                _require_whole(path, file, folder)
        with alone_in({target.parent for target in targets}), ExitStack() as undo:
            for path, target, file, folder in zip(paths, targets, new, folders, strict=True):
                with _as_input_error(path, _UNWRITTEN):
                    require_replaceable(path, target)
                    inherit(file, target)
                    if len(paths) > 1:
                        undo.callback(put_back, target, set_aside(target, folder), file.lstat())
                    file.replace(target)
            undo.pop_all()


@contextmanager
def making_folder(path: Path) -> Iterator[None]:
    """Make a folder, and those above it, where there is none; leaving by an error removes what was made.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    with ExitStack() as undo:
        with _as_input_error(path, _NO_FOLDER):
            for folder in reversed(_missing(path)):
                with suppress(FileExistsError):  # another process may have made it
                    folder.mkdir()
                    undo.callback(_remove_if_empty, folder)
            if not path.is_dir():
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
        yield
        undo.pop_all()


def require_room(path: Path, size: int) -> None:
    """Check that ``size`` bytes can be written in the place of ``path``, by writing as many for a moment.

    For programs that do not find out by themselves that a disk is full. To write them finds more than to ask how much
    room there is: quotas, limits, and disks that do not tell.

    Raises
    ------
    InputError
        If they cannot be written.
    """
    (target,) = _targets([path], ())
    block = os.urandom(2**20)  # nothing that a file system could compress
    with (
        _as_input_error(path, _UNWRITTEN),
        PrivateFolder(target.parent) as folder,
        (folder / "room").open("wb") as file,
    ):
        for start in range(0, size, len(block)):
            file.write(block[: size - start])
        file.flush()
        os.fsync(file.fileno())


_UNWRITTEN = "cannot be written"
_NO_FOLDER = "cannot be made a folder"


@contextmanager
def _as_input_error(what: Path | str, problem: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(f"{what} {problem}: {with_remedy(error)}.") from error


def _targets(paths: Sequence[Path], inputs: Sequence[Path]) -> list[Path]:
    """Where files will be, links followed; raises InputError where one is no file, or named twice."""
    seen: dict[object, int] = {key: -1 for path in inputs for key in _identities(path)}
    targets = []
    for number, path in enumerate(paths):
        try:
            with _as_input_error(path, _UNWRITTEN):
                targets.append(Path(os.path.realpath(path)))
                mode = path.stat().st_mode if _is_there(path) else stat.S_IFREG  # also a link to no file yet
        except ValueError as error:
            raise InputError(f"{path} {_UNWRITTEN}: {error}; choose another name.") from error
        if stat.S_ISDIR(mode):
            raise InputError(f"{path} is a folder; give the name of a file.")
        if not stat.S_ISREG(mode):
            raise InputError(NO_FILE.format(path))
        if any(seen.setdefault(key, number) != number for key in _identities(path)):
            raise InputError(f"{path} is named twice; input, output and report must be different files.")
    return targets


def _identities(path: Path) -> list[object]:
    """What two names of the same file have in common: where links lead, and the number of what is there."""
    found: list[object] = []
    with suppress(OSError, ValueError):  # said where it is read or written
        found.append(os.path.normcase(os.path.realpath(path)))
        status = path.stat()
        if status.st_ino:  # not every file system has numbers
            found.append((status.st_dev, status.st_ino))
    return found


def _is_there(path: Path) -> bool:
    try:
        path.stat()
    except FileNotFoundError:
        return False
    return True


def _missing(folder: Path) -> list[Path]:
    """The folders that have to be made, the last one first."""
    found = []
    while not _is_there(folder):
        found.append(folder)
        folder = folder.parent
    return found


def _require_whole(path: Path, new: Path, folder: Path) -> None:
    """Check that there is one file, all of it on the disk."""
    if not new.is_file():
        raise InputError(f"{path} was not written; choose another format or place.")
    if new.parent == folder and len(list(folder.iterdir())) > 2:  # the file, and the folder's mark
        raise InputError(f"{path} cannot be written: its format takes several files; choose another one.")
    with new.open("r+b") as file:
        os.fsync(file.fileno())  # some disks say no earlier that they are full


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
