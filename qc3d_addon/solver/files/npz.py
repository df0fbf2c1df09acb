# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads .npz archives from untrusted sources, and writes them."""

from __future__ import annotations

import codecs
import io
import math
import stat
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from ..errors import InputError, reason, remedy_of_limit

# Everything that reading truncated, corrupt, encrypted or hostile archives was seen to raise, mostly by fuzzing.
_UNREADABLE = (
    OSError, ValueError, EOFError, MemoryError, OverflowError, RuntimeError, LookupError, TypeError, AttributeError,
    SyntaxError, tokenize.TokenError, struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
codecs.lookup("cp437")  # of names in archives: loaded now, since Python calls it unknown when no file can be opened
MOST_BYTES = 2**31  # limit for a file, for an array in it, and for all arrays that are read together
_MOST_DIRECTORY = 2**22  # bytes of an archive's directory, which takes about ten times as much when parsed
_MOST_HEADER = 2**14  # bytes of an array's header; numpy itself reads at most 10,000
_LEAST_HELD = 8  # bytes counted for each number: most arrays are converted to double precision


def write_arrays(path: Path | BinaryIO, arrays: Mapping[str, NDArray[Any]], is_compressed: bool = True) -> None:
    """Write arrays to an .npz file, or to an open one.

    Unlike ``np.savez``, an error leaves no open file and no warning behind.

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


class Header(NamedTuple):
    """The header of an array, known before the array is read.

    Parameters
    ----------
    shape : tuple of int
    dtype : np.dtype
    """

    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def held(self) -> int:
        """Bytes of memory that the array takes, counting at least 8 for each number."""
        return math.prod(self.shape) * max(self.dtype.itemsize, _LEAST_HELD)

    @property
    def rows(self) -> int:
        """Length of the first axis; 0 for a scalar."""
        return self.shape[0] if self.shape else 0


class Archive:
    """The arrays of an open .npz file. Headers and sizes are checked before anything is allocated.

    Parameters
    ----------
    file : BinaryIO
        The open file.
    what : str or Path
        Name of the file for error messages.
    needed : str
        What the file should contain, for error messages.

    Raises
    ------
    InputError
        If it is not an .npz archive, or contains a name twice or something that is not an array.

    Attributes
    ----------
    names : tuple of str
        Names of its arrays.
    """

    def __init__(self, file: BinaryIO, what: Path | str, needed: str) -> None:
        self._what = what
        self._headers: dict[str, Header] = {}
        source: Any = _ListedFirst(file)
        try:
            self._zip = zipfile.ZipFile(source)
        except _UNREADABLE as error:
            raise InputError(f"{what} is not an .npz file of arrays; {needed}.") from error
        source.most = None
        self._entries: dict[str, zipfile.ZipInfo] = {}
        for entry in self._zip.infolist():
            name = entry.filename.removesuffix(".npy")
            if name == entry.filename:
                raise InputError(f"{what} holds {name!r}, which is no array: their names end in .npy; remove it.")
            if name in self._entries:
                raise InputError(f"{what} holds two arrays named {name!r}; remove one of them.")
            self._entries[name] = entry
        self.names = tuple(self._entries)

    def __contains__(self, name: str) -> bool:
        return name in self._entries

    def headers(self, names: Iterable[str]) -> dict[str, Header]:
        """The headers of the given arrays, by name.

        Raises
        ------
        InputError
            If an array is missing or cannot be read, if its size does not match its header, or if the arrays together
            are too large.
        """
        found = {name: self._header(name) for name in names}
        held = sum(header.held for header in found.values())
        if held > MOST_BYTES:
            raise InputError(
                f"The arrays {', '.join(found)} in {self._what} take {held} bytes of memory, and at most {MOST_BYTES} "
                "are read; make them smaller."
            )
        return found

    def read(self, names: Iterable[str]) -> dict[str, NDArray[Any]]:
        """The given arrays by name; raises InputError as ``headers`` does."""
        return {name: self._array(name) for name in self.headers(names)}

    def _header(self, name: str) -> Header:
        if name not in self._headers:
            if name not in self:
                raise InputError(f"{self._what} has no array {name}; it has {', '.join(self.names) or 'none'}.")
            with self._reading(name):
                self._headers[name] = _checked_header(self._zip, self._entries[name])
        return self._headers[name]

    def _array(self, name: str) -> NDArray[Any]:
        npy: Any = npy_format  # without types in some versions
        with self._reading(name), self._zip.open(self._entries[name]) as entry:
            array: NDArray[Any] = npy.read_array(entry, allow_pickle=False)
        return array

    @contextmanager
    def _reading(self, name: str) -> Iterator[None]:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # numpy warns of headers written by other versions
                yield
        except _UNREADABLE as error:
            raise unreadable(f"The array {name} in {self._what}", error) from error


class _ListedFirst:
    """A file that refuses to read more than ``most`` bytes at once, while an archive's directory is read."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.most: int | None = _MOST_DIRECTORY

    def read(self, size: int = -1) -> bytes:
        if self.most is not None and size > self.most:
            raise ValueError("the list of its entries is too long")
        return self._file.read(size)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - of the file
        return getattr(self._file, name)


@contextmanager
def open_archive(path: Path, needed: str) -> Iterator[Archive]:
    """Open an .npz file of arrays without pickled objects; ``needed`` says what it should contain, for error messages.

    Raises
    ------
    InputError
        If the file cannot be read or is not an .npz file.
    """
    require_file(path)
    try:
        file = path.open("rb")
    except OSError as error:
        raise unreadable(path, error) from error
    with file:
        # Not np.load: it would read any other file of numpy whole before it could be refused.
        yield Archive(file, path, needed)


def require_file(path: Path, most: int = MOST_BYTES) -> None:
    """Check that a path is an ordinary file before it is opened: reading a pipe or device may never end.

    Raises
    ------
    InputError
        If there is no ordinary file of that name, or if it is larger than ``most`` bytes.
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
    """The error to raise when reading fails, with a remedy."""
    is_missing = isinstance(error, (FileNotFoundError, NotADirectoryError))
    remedy = "name a file that exists" if is_missing else "export it again, or name another file"
    remedy = remedy_of_limit(error) or remedy
    return InputError(f"{what} cannot be read: {reason(error)}; {remedy}.")


def _checked_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Header:
    """Read an array's header; ValueError if it does not match the size of its entry or exceeds the limits."""
    npy: Any = npy_format  # without types in some versions
    # Other compression methods may expand to any size without warning, and an LZMA header decides how much memory is
    # allocated.
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("it is compressed by a method that numpy does not write")
    if entry.file_size > MOST_BYTES:
        raise ValueError(f"it has {entry.file_size} bytes, and at most {MOST_BYTES} are read")
    with archive.open(entry) as file:
        beginning = io.BytesIO(file.read(_MOST_HEADER))
    read_header = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    version = npy.read_magic(beginning)
    if version not in read_header:
        raise ValueError(f"it has version {version}, which is not known")
    try:
        shape, _, dtype = read_header[version](beginning)
    except tokenize.TokenError as error:
        raise ValueError("its header cannot be parsed") from error
    if dtype.hasobject:
        raise ValueError("it holds objects of Python, which are never read")
    count = math.prod(shape)
    if min(shape, default=0) < 0:
        raise ValueError("its shape makes no sense")
    if count and not dtype.itemsize:
        raise ValueError("its items have no size")
    if beginning.tell() + count * dtype.itemsize != entry.file_size:
        raise ValueError("it is not as large as it says")
    return Header(tuple(shape), dtype)
