# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Archives of arrays, read without trusting them; files written whole or not at all."""

from __future__ import annotations

import math
import os
import shutil
import stat
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from ..errors import InputError

# All that reading a damaged or hostile archive has been seen to raise: truncated, corrupt, encrypted, absurd shapes.
_UNREADABLE = (OSError, ValueError, EOFError, MemoryError, OverflowError, RuntimeError, zipfile.BadZipFile, zlib.error)
MOST_BYTES = 2**31  # of a file that is read, and of an array in it


@contextmanager
def open_archive(path: Path, needed: str) -> Iterator[NpzFile]:
    """Open an .npz file of arrays, without pickled objects; ``needed`` says what it should hold.

    Raises
    ------
    InputError
        If the file cannot be read or is something else.
    """
    require_file(path)
    with ExitStack() as stack:
        try:
            # Not np.load: it would read any other file of numpy whole before it could be refused.
            file: Any = stack.enter_context(path.open("rb"))  # numpy's types expect a text file in some versions
            archive = NpzFile(file, allow_pickle=False)
        except OSError as error:
            raise unreadable(path, error) from error
        except _UNREADABLE as error:
            raise InputError(f"{path} is not an .npz file of arrays; {needed}.") from error
        yield stack.enter_context(archive)


def read_array(archive: NpzFile, name: str, path: Path) -> NDArray[np.generic]:
    """An array of an open archive; ``path`` is named where it is not there.

    Raises
    ------
    InputError
        If there is no such array, or it cannot be read.
    """
    try:
        if name in archive.files:
            assert archive.zip is not None
            _require_size(archive.zip, f"{name}.npy")
        array: NDArray[np.generic] = archive[name]
    except KeyError:
        raise InputError(f"{path} has no array {name}; it has {', '.join(archive.files) or 'none'}.") from None
    except _UNREADABLE as error:
        raise unreadable(f"The array {name} in {path}", error) from error
    return array


def require_file(path: Path, most: int = MOST_BYTES) -> None:
    """Check a name before it is opened: pipes and devices may never end.

    Raises
    ------
    InputError
        If there is no ordinary file of that name, or it is larger than any file should be that is read here.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from error
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"{path} is no file that can be read; name a file.")
    if found.st_size > most:
        raise InputError(f"{path} has {found.st_size} bytes, and at most {most} are read; make it smaller.")


def unreadable(what: Path | str, error: BaseException) -> InputError:
    """The error to raise where reading failed."""
    return InputError(f"{what} cannot be read: {_reason(error)}; export it again, or name another file.")


def require_sizes(archive: zipfile.ZipFile) -> None:
    """Check, before anything is allocated, that every array is as large as its entry says, and all can be held.

    Raises
    ------
    ValueError
        If not.
    """
    if sum(info.file_size for info in archive.infolist()) > MOST_BYTES:
        raise ValueError("the arrays are too large")
    for info in archive.infolist():
        _require_size(archive, info.filename)


def _require_size(archive: zipfile.ZipFile, name: str) -> None:
    """Raise ValueError unless an array is as large as its entry says, and of a size that can be held."""
    npy: Any = npy_format  # without types in some versions
    info = archive.getinfo(name)
    if info.file_size > MOST_BYTES:
        raise ValueError(f"it has {info.file_size} bytes, and at most {MOST_BYTES} are read")
    with archive.open(info) as file:
        read_header = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
        version = npy.read_magic(file)
        if version not in read_header:
            raise ValueError(f"it has version {version}, which is not known")
        try:
            shape, _, dtype = read_header[version](file)
        except tokenize.TokenError as error:
            raise ValueError("its header cannot be parsed") from error
        if dtype.hasobject:
            raise ValueError("it holds objects of Python, which are never read")
        if file.tell() + math.prod(shape) * dtype.itemsize != info.file_size:
            raise ValueError("it is not as large as it says")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give the absolute name of a new file beside ``path``, which takes its place when the block ends well.

    Entering tells at once whether the place can be written, before any work; leaving by an error removes the new file
    and keeps what was there.

    Raises
    ------
    InputError
        If ``path`` cannot be written.
    """
    with replacing_all(path) as (new,):
        yield new


@contextmanager
def replacing_all(*paths: Path) -> Iterator[list[Path]]:
    """As ``replacing`` for several files: all take their places, or none does."""
    targets = [path.resolve() for path in paths]
    with ExitStack() as stack:
        new = []
        for path, target in zip(paths, targets, strict=True):
            new.append(_new_beside(path, target))
            stack.callback(new[-1].unlink, missing_ok=True)
        yield new
        with ExitStack() as undo:
            for number, (file, target) in enumerate(zip(new, targets, strict=True)):
                if number < len(new) - 1:  # after the last nothing can fail
                    undo.callback(_put_back, target, stack.enter_context(_set_aside(target)))
                try:
                    file.replace(target)
                except OSError as error:
                    raise InputError(f"{target} cannot be written: {_reason(error)}; nothing was.") from error
            undo.pop_all()


def _new_beside(path: Path, target: Path) -> Path:
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the name of a file.")
    new = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        new.touch(exist_ok=False)
        new.unlink()  # Blender would keep even an empty file as a backup of the one it saves
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be written: {_reason(error)}.") from error
    return new


@contextmanager
def _set_aside(target: Path) -> Iterator[Path | None]:
    """Another name for the file that is there now, if there is one, gone when the block ends."""
    if not target.exists():
        yield None
        return
    kept = target.with_name(f".{target.stem}.{os.getpid()}.old{target.suffix}")
    try:
        os.link(target, kept)
    except OSError:  # not every file system has links
        shutil.copy2(target, kept)
    try:
        yield kept
    finally:
        kept.unlink(missing_ok=True)


def _put_back(target: Path, kept: Path | None) -> None:
    if kept is None:
        target.unlink(missing_ok=True)
    else:
        kept.replace(target)


def _reason(error: BaseException) -> str:
    """What went wrong as a clause: the system's own words where there are some, on one line, without a full stop."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(text.split()).rstrip(".") or type(error).__name__
