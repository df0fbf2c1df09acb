# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole numbers as few bytes: small ones cost little, and runs of zeros nearly nothing."""

from __future__ import annotations

import lzma
import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

_LZMA = [{"id": lzma.FILTER_LZMA2, "preset": 9, "dict_size": 1 << 20}]
_RAW_LZMA, _DEFLATE = b"L", b"Z"


def packed(numbers: NDArray[np.int64]) -> bytes:
    """Signed whole numbers (k,) as bytes: the lowest byte of all, then the next, as far as the largest needs."""
    flat = np.ascontiguousarray(numbers, dtype=np.int64).ravel()
    # 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
    folded = ((flat << 1) ^ (flat >> 63)).astype("<u8")
    planes = folded.view(np.uint8).reshape(-1, 8)
    used = int(np.flatnonzero(planes.any(axis=0)).max(initial=-1)) + 1
    return bytes([used]) + np.ascontiguousarray(planes[:, :used].T).tobytes()


def unpacked(data: bytes, count: int) -> tuple[NDArray[np.int64], int]:
    """The ``count`` numbers at the beginning of ``data``, and how many bytes they took; raises InputError if short."""
    if not data or data[0] > 8 or len(data) < 1 + data[0] * count:
        raise InputError("The numbers end too early; the file is damaged.")
    used = data[0]
    planes = np.zeros((count, 8), dtype=np.uint8)
    planes[:, :used] = np.frombuffer(data, np.uint8, used * count, 1).reshape(used, count).T
    folded = planes.view("<u8").ravel()
    return (folded >> 1).astype(np.int64) ^ -(folded & 1).astype(np.int64), 1 + used * count


def deflated(data: bytes) -> bytes:
    """Bytes compressed by whichever of deflate and LZMA makes less of them."""
    choices = (
        _DEFLATE + zlib.compress(data, 9),
        _RAW_LZMA + lzma.compress(data, format=lzma.FORMAT_RAW, filters=_LZMA),
    )
    return min(choices, key=len)


def inflated(data: bytes, most: int) -> bytes:
    """What was compressed; never more than ``most`` bytes are made.

    Raises
    ------
    InputError
        If the data is damaged, or longer than that.
    """
    kind, body = data[:1], data[1:]
    decompress: Callable[[bytes, int], bytes]
    if kind == _DEFLATE:
        decompress = zlib.decompressobj().decompress
    elif kind == _RAW_LZMA:
        decompress = lzma.LZMADecompressor(format=lzma.FORMAT_RAW, filters=_LZMA).decompress
    else:
        raise InputError("The data is not compressed in a way this version knows.")
    try:
        result = decompress(body, most + 1)
    except (zlib.error, lzma.LZMAError, EOFError) as error:
        raise InputError(f"The compressed data is damaged: {error}.") from error
    if len(result) > most:
        raise InputError("The compressed data is longer than its header says; the file is damaged.")
    return result
