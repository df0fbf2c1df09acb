# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Archives of arrays, read without trusting them."""

from __future__ import annotations

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

# All that reading a damaged or hostile archive has been seen to raise: truncated, corrupt, encrypted, absurd headers.
_UNREADABLE = (
    OSError, ValueError, EOFError, MemoryError, OverflowError, RuntimeError, LookupError, TypeError, AttributeError,
    SyntaxError, tokenize.TokenError, struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
MOST_BYTES = 2**31  # of a file that is read, of an array in it, and of all arrays that are read together
_MOST_DIRECTORY = 2**22  # bytes of the list of an archive's arrays, which is held ten times over
_MOST_HEADER = 2**14  # bytes of the header of an array; numpy itself reads no more than 10,000
_LEAST_HELD = 8  # bytes of each number of an array: most are made floating-point numbers


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


class Header(NamedTuple):
    """What an array says of itself before it is read.

    Parameters
    ----------
    shape : tuple of int
    dtype : np.dtype
    """

    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def held(self) -> int:
        """Bytes that the array takes, or that it would take as 64-bit numbers where that is more."""
        return math.prod(self.shape) * max(self.dtype.itemsize, _LEAST_HELD)

    @property
    def rows(self) -> int:
        """Its length; 0 of a single number."""
        return self.shape[0] if self.shape else 0


class Archive:
    """The arrays of an .npz file that is open. Nothing is allocated before headers and sizes have been looked at.

    Parameters
    ----------
    file : BinaryIO
    what : str or Path
        What errors call it.
    needed : str
        What it should hold, for errors.

    Raises
    ------
    InputError
        If it is no such archive, or holds a name twice or something that is no array.

    Attributes
    ----------
    names : tuple of str
        Of its arrays.
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
        """What arrays that are to be read say of themselves, by their names.

        Raises
        ------
        InputError
            If one is not there, is not as large as it says, or could not be read; or if they are too much together.
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
        """Arrays by their names; raises InputError as ``headers`` does."""
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
                warnings.simplefilter("ignore")  # of headers in the words of other versions
                yield
        except _UNREADABLE as error:
            raise unreadable(f"The array {name} in {self._what}", error) from error


class _ListedFirst:
    """A file of which, while an archive's list of entries is read, no more than that may be is read at once."""

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
    """Open an .npz file of arrays, without pickled objects; ``needed`` says what it should hold.

    Raises
    ------
    InputError
        If the file cannot be read or is something else.
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


def _checked_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Header:
    """What an array says of itself; ValueError unless it is as large as its entry says, and of a size that is read."""
    npy: Any = npy_format  # without types in some versions
    # Other methods are not asked how much they make of little, and LZMA is told how much memory to take.
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
