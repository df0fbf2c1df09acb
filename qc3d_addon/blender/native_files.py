# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender itself reads and writes: the limit on their names, its error messages, incomplete files."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import BinaryIO

from ..solver.errors import InputError

_LONGEST_PATH = 1023  # bytes; Blender silently cuts off the rest

# The start of a compressed .blend, and what its table of compressed pieces ends with (Zstandard's seekable format).
_COMPRESSED = b"\x28\xb5\x2f\xfd"
_TABLE_END, _TABLE_MAGIC = struct.Struct("<IBI"), 0x8F92EAB1  # number of pieces, whether with checksums, magic word
_HEADER_OF_TABLE = 8  # bytes
# Blocks of a plain .blend up to version 4: code, bytes, address, kind, count; since 5 the bytes come after the address.
_BLOCK, _LARGE_BLOCK = struct.Struct("<4sIQII"), struct.Struct("<4sIQQQ")


def require_short(path: Path, shown: Path) -> None:
    """Raise InputError for a name that Blender would cut off; the message calls the file ``shown``."""
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise InputError(f"The name {shown} is too long for Blender; choose a folder with a shorter one.")


def words(error: RuntimeError, new: Path, shown: Path) -> str:
    """Message of one of Blender's operators as a clause, with the file ``new`` called ``shown``."""
    text = str(error).removeprefix("Error: ").replace(str(new), str(shown))
    return " ".join(text.split()).rstrip(".")


def is_whole(path: Path) -> bool:
    """Whether a .blend file is as long as it says itself, compressed or not.

    Blender says that a file is saved where the disk got full with its last bytes.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(17)
        try:
            if start.startswith(_COMPRESSED):
                return _end_of_pieces(file, size) == size
            return start.startswith(b"BLENDER") and _end_of_blocks(file, start, size) == size
        except struct.error:  # it ends in the middle of a header
            return False


def _end_of_pieces(file: BinaryIO, size: int) -> int:
    """Where a compressed file ends by the table of its pieces, the last thing in it."""
    file.seek(max(size - _TABLE_END.size, 0))
    count, flags, magic = _TABLE_END.unpack(file.read())
    entry = struct.Struct("<III" if flags & 0x80 else "<II")  # bytes compressed and not, and perhaps a checksum
    table: int = entry.size * count + _TABLE_END.size
    if magic != _TABLE_MAGIC or table > size:
        return -1
    file.seek(size - table)
    pieces: int = sum(values[0] for values in entry.iter_unpack(file.read(entry.size * count)))
    return pieces + _HEADER_OF_TABLE + table


def _end_of_blocks(file: BinaryIO, start: bytes, size: int) -> int:
    """Where a plain file ends by the lengths of its blocks; -1 where something else than a block comes."""
    is_large = start[7:8].isdigit()  # then the length of the header follows its first word
    block = _LARGE_BLOCK if is_large else _BLOCK
    at = int(start[7:9]) if is_large else 12
    while at <= size:
        file.seek(at)
        code, *values = block.unpack(file.read(block.size))
        if not code[:2].isalnum():
            break
        length: int = values[2 if is_large else 0]
        at += block.size + length
        if code == b"ENDB":
            return at
    return -1
