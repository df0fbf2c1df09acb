# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of whole numbers as few bytes: small ones cost little, and what goes on as before costs nearly nothing."""

from __future__ import annotations

import lzma
import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .entropy import decoded, encoded
from .prediction import Predictor

# Numbers that are predicted at once.
_AT_ONCE = 1 << 20
# Orders of the differences along the row: none, one for what stays, two for what moves on steadily.
_ORDERS = 3
_DICTIONARY = 1 << 22  # bytes; what reading takes is little more

Encode = Callable[[NDArray[np.int64]], bytes]


def packed(rows: NDArray[np.int64], predictor: Predictor | None = None, encode: Encode = encoded) -> bytes:
    """Rows (F, n, c) as bytes: differences along the row, of whichever order makes them smallest.

    Where the n numbers belong to points a predictor takes away what neighbors tell. ``encode`` makes bytes of what is
    left.
    """
    choices = [_differences(rows, order) for order in range(max(min(_ORDERS, len(rows)), 1))]
    order, left = min(enumerate(choices), key=lambda choice: float(np.log2(1 + np.abs(choice[1])).sum()))
    if predictor is not None:
        left = _together(predictor.differences, left)
    return bytes([order]) + encode(left.transpose(0, 2, 1))


def unpacked(
    data: bytes,
    shape: tuple[int, int, int],
    predictor: Predictor | None = None,
    decode: Callable[[bytes, int], NDArray[np.int64]] = decoded,
) -> NDArray[np.int64]:
    """The rows of this shape, whose numbers ``decode`` finds; InputError where the data does not hold as many."""
    if not data or data[0] >= _ORDERS:
        raise InputError("The numbers are stored in a way this version does not know; the file is damaged.")
    count, points, channels = shape
    rows = decode(data[1:], count * points * channels).reshape(count, channels, points).transpose(0, 2, 1)
    if predictor is not None:
        rows = _together(predictor.numbers, rows)
    for _ in range(data[0]):
        rows = np.cumsum(rows, axis=0)
    return np.ascontiguousarray(rows)


def _together(
    predicted: Callable[[NDArray[np.int64]], NDArray[np.int64]], rows: NDArray[np.int64]
) -> NDArray[np.int64]:
    """What becomes of each row (n, c) of (F, n, c): many short rows side by side cost as little as a few long ones."""
    count, points, channels = rows.shape
    size = max(1, _AT_ONCE // max(1, points * channels))
    made = np.empty_like(rows)
    for start in range(0, count, size):
        some = rows[start : start + size]
        beside = predicted(np.ascontiguousarray(some.transpose(1, 0, 2)).reshape(points, len(some) * channels))
        made[start : start + size] = beside.reshape(points, len(some), channels).transpose(1, 0, 2)
    return made


def _differences(rows: NDArray[np.int64], order: int) -> NDArray[np.int64]:
    for _ in range(order):
        rows = np.diff(rows, axis=0, prepend=np.zeros_like(rows[:1]))
    return rows


def planes(numbers: NDArray[np.int64]) -> bytes:
    """Signed whole numbers as bytes: the lowest byte of all, then the next, as far as the largest needs."""
    flat = np.ascontiguousarray(numbers, dtype=np.int64).ravel()
    # 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
    folded = ((flat << 1) ^ (flat >> 63)).astype("<u8")
    table = folded.view(np.uint8).reshape(-1, 8)
    used = int(np.flatnonzero(table.any(axis=0)).max(initial=-1)) + 1
    return np.ascontiguousarray(table[:, :used].T).tobytes()


def planes_shortened(numbers: NDArray[np.int64]) -> bytes:
    """The ``planes`` of numbers by lzma: of large numbers about as few bytes as ``encoded``, in a tenth of the time."""
    return lzma.compress(planes(numbers), lzma.FORMAT_RAW, filters=_filters())


def planes_read(data: bytes, count: int) -> NDArray[np.int64]:
    """The ``count`` numbers that ``planes_shortened`` made data of, as often as it takes; never more than these need.

    Raises
    ------
    InputError
        If the data is damaged, or does not hold exactly as many.
    """
    try:
        content = lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=_filters()).decompress(data, 8 * count + 1)
    except (lzma.LZMAError, EOFError) as error:
        raise InputError("The numbers cannot be decoded; the file is damaged.") from error
    used, left = divmod(len(content), max(count, 1))
    if left or used > 8:
        raise InputError("The numbers are not as many as they should be; the file is damaged.")
    table = np.zeros((count, 8), dtype=np.uint8)
    table[:, :used] = np.frombuffer(content, dtype=np.uint8).reshape(used, count).T
    folded = table.view("<u8").ravel().astype(np.uint64)
    return np.asarray((folded >> np.uint64(1)).astype(np.int64) ^ -(folded & np.uint64(1)).astype(np.int64))


def _filters() -> list[dict[str, int]]:
    return [{"id": lzma.FILTER_LZMA1, "preset": 9, "dict_size": _DICTIONARY, "lc": 0, "lp": 0, "pb": 0}]


def inflated(data: bytes, size: int) -> bytes:
    """What was deflated, exactly ``size`` bytes; never more than that are made.

    Raises
    ------
    InputError
        If the data is damaged, or not as long.
    """
    try:
        result = zlib.decompressobj().decompress(data, size + 1)
    except zlib.error as error:
        raise InputError(f"The compressed data is damaged: {error}.") from error
    if len(result) != size:
        raise InputError("The compressed data has another length than its header says; the file is damaged.")
    return result


def inflated_at_most(data: bytes, most: int) -> bytes:
    """What was deflated, if it is at most so many bytes; InputError where it is damaged or longer."""
    opener = zlib.decompressobj()
    try:
        result = opener.decompress(data, most)
    except zlib.error as error:
        raise InputError(f"The compressed data is damaged: {error}.") from error
    if not opener.eof:
        raise InputError("The compressed data is damaged, or longer than can be read.")
    return result
