# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Archives of arrays, read without trusting them."""

from __future__ import annotations

import math
import stat
import tokenize
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from ..errors import InputError, reason, remedy_of_limit

# All that reading a damaged or hostile archive has been seen to raise: truncated, corrupt, encrypted, absurd shapes.
_UNREADABLE = (OSError, ValueError, EOFError, MemoryError, OverflowError, RuntimeError, zipfile.BadZipFile, zlib.error)
MOST_BYTES = 2**31  # of a file that is read, and of an array in it


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]], is_compressed: bool = True) -> None:
    """Write arrays to an .npz file, as ``np.savez`` does; of an error nothing is left, no open file and no warning.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    npy: Any = npy_format  # without types in some versions
    method = zipfile.ZIP_DEFLATED if is_compressed else zipfile.ZIP_STORED
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                npy.write_array(entry, np.asanyarray(array), allow_pickle=False)


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
    remedy = remedy_of_limit(error) or "export it again, or name another file"
    return InputError(f"{what} cannot be read: {reason(error)}; {remedy}.")


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
