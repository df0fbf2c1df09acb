# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Archives that no ordinary program writes: small files that would take much memory, and ambiguous names."""

from __future__ import annotations

import bz2
import io
import lzma
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from ..solver.meshes import icosphere

POINTS, FACES = icosphere(0)
SHAPES = {"faces": FACES, "shape_names": np.array(["a", "b"]), "V0": POINTS, "V1": 1.1 * POINTS}
MEGABYTE = bytes(2**20)


def array(values: np.ndarray) -> bytes:
    """An array as numpy writes it."""
    buffer = io.BytesIO()
    npy.write_array(buffer, values, allow_pickle=False)  # type: ignore[no-untyped-call,unused-ignore]
    return buffer.getvalue()


def header(shape: tuple[int, ...], kind: str) -> bytes:
    """What stands before the numbers of an array."""
    buffer = io.BytesIO()
    described = {"descr": kind, "fortran_order": False, "shape": shape}
    npy.write_array_header_1_0(buffer, described)  # type: ignore[no-untyped-call,unused-ignore]
    return buffer.getvalue()


class Builder:
    """An archive, entry by entry; entries of zeros are not made in memory.

    Parameters
    ----------
    arrays : dict
        What it holds to begin with, by name.
    """

    def __init__(self, path: Path, arrays: dict[str, np.ndarray]) -> None:
        self._zip = zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED)
        for name, values in arrays.items():
            self.entry(f"{name}.npy", array(values))

    def entry(self, name: str, content: bytes, method: int = zipfile.ZIP_DEFLATED) -> Builder:
        """Add an entry of any name."""
        self._zip.writestr(name, content, method)
        return self

    def zeros(self, name: str, shape: tuple[int, ...], kind: str, before: bytes | None = None) -> Builder:
        """Add an array of zeros, or, instead of its header, something else ``before`` them."""
        count = int(np.prod(shape, dtype=np.int64)) * np.dtype(kind).itemsize
        with self._zip.open(name, "w", force_zip64=True) as entry:
            entry.write(header(shape, kind) if before is None else before)
            for _ in range(count // len(MEGABYTE)):
                entry.write(MEGABYTE)
            entry.write(bytes(count % len(MEGABYTE)))
        return self

    def close(self) -> None:
        """Finish the file."""
        self._zip.close()


def without(*names: str) -> dict[str, np.ndarray]:
    """The shapes without some arrays."""
    return {name: values for name, values in SHAPES.items() if name not in names}


def with_entry(path: Path, name: str, packed: bytes, method: int, size: int, checksum: int) -> None:
    """Write the shapes with one entry packed by any method that claims to be of any size."""
    builder = Builder(path, without(name))
    builder.close()
    whole = path.read_bytes()
    end = whole.rindex(b"PK\x05\x06")
    start = struct.unpack("<I", whole[end + 16 : end + 20])[0]
    directory, encoded = whole[start:end], f"{name}.npy".encode()
    sizes = struct.pack("<III", checksum, len(packed), size)
    local = b"PK\x03\x04" + struct.pack("<HHHHH", 63, 0, method, 0, 33) + sizes + struct.pack("<HH", len(encoded), 0)
    listed = (
        b"PK\x01\x02"
        + struct.pack("<HHHHHH", 63, 63, 0, method, 0, 33)
        + sizes
        + struct.pack("<HHHHHII", len(encoded), 0, 0, 0, 0, 0, start)
    )
    directory += listed + encoded
    count = struct.unpack("<H", whole[end + 10 : end + 12])[0] + 1
    before = whole[:start] + local + encoded + packed
    ending = b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, count, count, len(directory), len(before), 0)
    path.write_bytes(before + directory + ending)


def bomb(path: Path, method: int, megabytes: int) -> None:
    """The shapes, one of them packed by bzip2 or LZMA, as large as it should be, with much more behind it."""
    content = array(POINTS)
    much = content + megabytes * MEGABYTE
    if method == zipfile.ZIP_BZIP2:
        packed = bz2.compress(much)
    else:
        filters = [{"id": lzma.FILTER_LZMA1, "preset": 0}]
        described = lzma._encode_filter_properties(filters[0])  # type: ignore[attr-defined]
        raw = lzma.compress(much, lzma.FORMAT_RAW, filters=filters)
        packed = struct.pack("<BBH", 9, 4, len(described)) + described + raw
    with_entry(path, "V0", packed, method, len(content), zlib.crc32(content))


def long_list(path: Path, entries: int) -> None:
    """An archive that lists the same entry of no size again and again."""
    one = b"PK\x01\x02" + struct.pack("<HHHHHHIIIHHHHHII", 20, 20, 0, 0, 0, 33, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0) + b"a.npy"
    ending = b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, entries % 65536, entries % 65536, entries * len(one), 0, 0)
    path.write_bytes(entries * one + ending)
