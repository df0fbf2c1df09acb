# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Output files: checked before the work, written in a private place, and moved into place completely or not at all."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from ..errors import InputError, with_remedy
from .private_folders import PrivateFolder
from .replacement import NO_FILE, alone_in, inherit, put_back, require_replaceable, set_aside

_LONGEST_SUFFIX = 50  # characters; no format has a longer suffix

BeforeReplacing = Callable[[dict[Path, Path]], None]
_before_replacing: BeforeReplacing | None = None


def require_writable(*paths: Path, inputs: Iterable[Path | None] = ()) -> None:
    """Check, before any work, that files can be written. Leaves nothing behind.

    Parameters
    ----------
    paths : Path
        The output files. Links are followed.
    inputs : iterable of Path or None, optional
        Input files, which must not be overwritten.

    Raises
    ------
    InputError
        If an output is a folder, device, pipe or socket, cannot be written, or is named twice.
    """
    targets = _targets(paths, [path for path in inputs if path is not None])
    for path, target in zip(paths, targets, strict=True):
        with _as_input_error(path, _UNWRITTEN):
            PrivateFolder(target.parent).close()
            require_replaceable(path, target)


def require_writable_in(folder: Path, names: Iterable[str], inputs: Iterable[Path | None] = ()) -> None:
    """As ``require_writable``, for files in a folder that need not exist yet.

    Raises
    ------
    InputError
        As ``require_writable``, and if the folder's path is something else.
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
    """As ``replacing_all``, for one file."""
    with replacing_all(path) as (new,):
        yield new


@contextmanager
def replacing_all(*paths: Path, beside: bool = False) -> Iterator[list[Path]]:
    """Context manager that gives temporary absolute paths to write to; at the end, the files replace ``paths``.

    All files are replaced or none. No files exist at the temporary paths, and no one else can create any there. If the
    block raises, the new files are removed and the old ones stay; an OSError becomes a one-sentence InputError. The new
    file gets the mode and access lists of the one that it replaces, and its owner if this user may give files away.

    Processes that replace several files in the same folder at the same time wait for each other, but only briefly: it
    matters more that each file is complete than that all of them come from the same process.

    Parameters
    ----------
    paths : Path
        The output files. Links are followed.
    beside : bool
        Whether to write the new files in the folders where they will stay. Formats such as .blend need that, because
        they name other files relative to their own place. By default they are written in private folders.

    Raises
    ------
    InputError
        As ``require_writable``, and if a file cannot be written or moved into place; then nothing has changed.
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
            if _before_replacing is not None:
                _before_replacing(dict(zip(targets, new, strict=True)))
            for path, target, file, folder in zip(paths, targets, new, folders, strict=True):
                with _as_input_error(path, _UNWRITTEN):
                    require_replaceable(path, target)
                    inherit(file, target)
                    if len(paths) > 1:
                        undo.callback(put_back, target, set_aside(target, folder), file.lstat())
                    file.replace(target)
            undo.pop_all()


@contextmanager
def before_replacing(call: BeforeReplacing) -> Iterator[None]:
    """Context manager that has ``call`` called when files are complete, before they take their places.

    It gets the complete file of each final path, and may write down what they are. If it raises, nothing is replaced.
    """
    global _before_replacing
    earlier, _before_replacing = _before_replacing, call
    try:
        yield
    finally:
        _before_replacing = earlier


@contextmanager
def making_folder(path: Path) -> Iterator[None]:
    """Context manager that makes a folder and its parents if needed; an error in the block removes what was made.

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
    """Check that ``size`` bytes can be written next to ``path``, by writing them and removing them again.

    For programs that do not notice that a disk is full. Asking for the free space would miss quotas, limits, and disks
    that do not report it.

    Raises
    ------
    InputError
        If they cannot be written.
    """
    (target,) = _targets([path], ())
    block = os.urandom(2**20)  # random, so that no file system can compress it
    with (
        _as_input_error(path, _UNWRITTEN),
        PrivateFolder(target.parent) as folder,
        (folder / "room").open("wb") as file,
    ):
        for start in range(0, size, len(block)):
            file.write(block[: size - start])
        file.flush()
        os.fsync(file.fileno())


def identities(path: Path) -> list[object]:
    """What two names of the same file have in common: the resolved path, and the device and inode numbers."""
    found: list[object] = []
    with suppress(OSError, ValueError):  # reported when it is read or written
        found.append(os.path.normcase(os.path.realpath(path)))
        status = path.stat()
        if status.st_ino:  # some file systems have no inode numbers
            found.append((status.st_dev, status.st_ino))
    return found


_UNWRITTEN = "cannot be written"
_NO_FOLDER = "cannot be made a folder"


@contextmanager
def _as_input_error(what: Path | str, problem: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(f"{what} {problem}: {with_remedy(error)}.") from error


def _targets(paths: Sequence[Path], inputs: Sequence[Path]) -> list[Path]:
    """The output files with links resolved; InputError if one is not an ordinary file or is named twice."""
    seen: dict[object, int] = {key: -1 for path in inputs for key in identities(path)}
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
        if any(seen.setdefault(key, number) != number for key in identities(path)):
            raise InputError(f"{path} is named twice; input, output and report must be different files.")
    return targets


def _is_there(path: Path) -> bool:
    try:
        path.stat()
    except FileNotFoundError:
        return False
    return True


def _missing(folder: Path) -> list[Path]:
    """The folders that do not exist yet, innermost first."""
    found = []
    while not _is_there(folder):
        found.append(folder)
        folder = folder.parent
    return found


def _require_whole(path: Path, new: Path, folder: Path) -> None:
    """Check that a single file was written, and that all of it has reached the disk."""
    if not new.is_file():
        raise InputError(f"{path} was not written; choose another format or place.")
    if new.parent == folder and len(list(folder.iterdir())) > 2:  # the file, and the folder's mark
        raise InputError(f"{path} cannot be written: its format takes several files; choose another one.")
    with new.open("r+b") as file:
        os.fsync(file.fileno())  # some disks do not report any earlier that they are full


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
