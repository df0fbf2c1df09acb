# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Signed whole numbers as few bytes, by whichever coder of Python's standard library makes the fewest.

The numbers 0, -1, 1, -2, ... become 0, 1, 2, 3, ...; one byte holds one of them, or two to five where nearly all are
small, since coders of bytes tell no byte in less than about a bit. What is too large for its place follows after all
others. Where nearly all are zeros, it is told how many are between the others.
"""

from __future__ import annotations

import bz2
import lzma
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

LARGEST = 2**50
_FULL = 7  # bytes of a number in full: the sign and 50 bits
# How many numbers a byte holds, and how many values each of them has there; the last value means that more follows.
_PACKS = ((1, 256), (2, 16), (3, 6), (4, 4), (5, 3))
# Literals by themselves, and literals that depend on the one before; never on the position.
_LITERAL_BITS = (0, 3)
_PLAIN, _DEFLATE, _BZ2 = 0, len(_LITERAL_BITS) + 1, len(_LITERAL_BITS) + 2
_CODERS = _BZ2 + 1
_DICTIONARY = 1 << 20  # bytes; what reading takes is little more
_IS_SPARSE, _SPARSE = 128, 0.1
_COUNT = struct.Struct("<I")
_PADDING = bytes(16)  # in place of the end of an lzma stream, which says nothing that is not known
_DAMAGED = "The numbers are not as many as they should be; the file is damaged."

Folded = NDArray[np.uint64]


def encoded(numbers: NDArray[np.int64]) -> bytes:
    """Whole numbers (k,), each below 2^50 in size, as bytes.

    Raises
    ------
    InputError
        If a number is too large.
    """
    ways = [bytes([way]) + prefix + data for way, prefix, data in _ways(_folded(numbers))]
    return min(ways, key=len)


def approximate_size(numbers: NDArray[np.int64]) -> int:
    """About as many bytes as ``encoded`` makes, found in a fraction of the time."""
    folded = _folded(numbers)
    filters = [{**_filters(0)[0], "preset": 1}]
    sizes = []
    for pack in range(3):
        content = _content(folded, pack)
        sizes += [len(content), len(_huffman(content)), len(lzma.compress(content, lzma.FORMAT_RAW, filters=filters))]
    return 1 + min(sizes)


def decoded(data: bytes, count: int) -> NDArray[np.int64]:
    """The ``count`` numbers that ``encoded`` made ``data`` of; never more bytes than these need are made.

    Raises
    ------
    InputError
        If the data is damaged, or does not hold exactly as many.
    """
    way = data[0] & ~_IS_SPARSE if data else 255
    if way >= len(_PACKS) * _CODERS:
        raise InputError("The numbers are stored in a way this version does not know; the file is damaged.")
    if data[0] & _IS_SPARSE:
        beside = _COUNT.unpack(data[1 : 1 + _COUNT.size])[0] if len(data) > _COUNT.size else count + 1
        if beside > count:
            raise InputError(_DAMAGED)
        pairs = _read(way, data[1 + _COUNT.size :], 2 * beside)
        # Gaps are at most the count, and at most so many of them are added: no sum is too large.
        places = np.cumsum(np.minimum(pairs[:beside], count).astype(np.int64) + 1) - 1
        if beside and places[-1] >= count:
            raise InputError(_DAMAGED)
        folded = np.zeros(count, dtype=np.uint64)
        folded[places] = pairs[beside:] + np.uint64(1)
    else:
        folded = _read(way, data[1:], count)
    numbers = (folded >> np.uint64(1)).astype(np.int64) ^ -(folded & np.uint64(1)).astype(np.int64)
    if numbers.size and np.abs(numbers).max() > LARGEST:
        raise InputError("The data means numbers that are too large; the file is damaged.")
    return np.asarray(numbers)


def _ways(folded: Folded) -> Iterator[tuple[int, bytes, bytes]]:
    """All ways to tell numbers: which it is, what comes first, and the coded numbers."""
    for pack in range(len(_PACKS)):
        for coder, data in _coded(_content(folded, pack)):
            yield coder + _CODERS * pack, b"", data
    beside = int(np.count_nonzero(folded))
    if beside < _SPARSE * len(folded):
        places = np.flatnonzero(folded)
        gaps = (np.diff(places, prepend=-1) - 1).astype("<u8")
        for coder, data in _coded(_content(np.concatenate([gaps, folded[places] - np.uint64(1)]), 0)):
            yield coder | _IS_SPARSE, _COUNT.pack(beside), data


def _folded(numbers: NDArray[np.int64]) -> Folded:
    """0, -1, 1, -2, ... as 0, 1, 2, 3, ..."""
    flat = np.ascontiguousarray(numbers, dtype=np.int64).ravel()
    if flat.size and np.abs(flat).max() >= LARGEST:
        raise InputError("A number is too large to be stored; allow a larger error.")
    return np.asarray(((flat << 1) ^ (flat >> 63)).astype("<u8"))


def _content(folded: Folded, pack: int) -> bytes:
    """Packed numbers; a byte of what each of those that is too large has beyond; those that are still, in full."""
    together, values = _PACKS[pack]
    last = np.uint64(values - 1)
    symbols = np.minimum(folded, last).astype(np.uint8)
    padded = np.zeros(-(-len(symbols) // together) * together, dtype=np.uint8)
    padded[: len(symbols)] = symbols
    packed = (padded.reshape(-1, together) * values ** np.arange(together)).sum(axis=1).astype(np.uint8)
    beyond = folded[folded >= last] - last
    full = np.ascontiguousarray(beyond[beyond >= 255]).view(np.uint8).reshape(-1, 8)[:, :_FULL]
    layers = (packed, np.minimum(beyond, 255).astype(np.uint8), full.T)
    return b"".join(layer.tobytes() for layer in layers)


def _read(way: int, data: bytes, count: int) -> Folded:
    """The numbers of a content that was coded in a way; InputError where there are not as many."""
    pack, coder = divmod(way, _CODERS)
    together, values = _PACKS[pack]
    ends = [-(-count // together)]
    content = _opened(coder, data, ends[0])
    packed = np.frombuffer(content, dtype=np.uint8).astype(np.int64)
    symbols = (packed[:, None] // values ** np.arange(together) % values).ravel()[:count]
    large = symbols == values - 1
    ends.append(ends[0] + int(np.count_nonzero(large)))
    content = _opened(coder, data, ends[1]) if ends[1] > ends[0] else content
    beyond = np.frombuffer(content[ends[0] :], dtype=np.uint8).astype(np.uint64)
    larger = beyond == 255
    ends.append(ends[1] + _FULL * int(np.count_nonzero(larger)))
    content = _opened(coder, data, ends[2]) if ends[2] > ends[1] else content
    if len(content) != ends[2] or (coder == _PLAIN and len(data) != ends[2]):
        raise InputError(_DAMAGED)
    table = np.zeros((np.count_nonzero(larger), 8), dtype=np.uint8)
    table[:, :_FULL] = np.frombuffer(content[ends[1] :], dtype=np.uint8).reshape(_FULL, -1).T
    beyond[larger] = table.view("<u8").ravel()
    folded = symbols.astype(np.uint64)
    folded[large] += beyond
    return folded


def _coded(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Content by each coder, and the coder's number."""
    yield _PLAIN, content
    for number, bits in enumerate(_LITERAL_BITS, start=1):
        yield number, _shortened(content, bits)
    deflate = zlib.compressobj(9, zlib.DEFLATED, -15)
    yield _DEFLATE, deflate.compress(content) + deflate.flush()
    yield _DEFLATE, _huffman(content)
    yield _BZ2, bz2.compress(content)


def _huffman(content: bytes) -> bytes:
    deflate = zlib.compressobj(9, zlib.DEFLATED, -15, 9, zlib.Z_HUFFMAN_ONLY)
    return deflate.compress(content) + deflate.flush()


def _filters(literal_bits: int) -> list[dict[str, int]]:
    preset = 9 | lzma.PRESET_EXTREME
    return [{"id": lzma.FILTER_LZMA1, "preset": preset, "dict_size": _DICTIONARY, "lc": literal_bits, "lp": 0, "pb": 0}]


def _shortened(content: bytes, literal_bits: int) -> bytes:
    """Content by lzma without its first byte, which is always 0, and as much of its end as is not needed."""
    data = lzma.compress(content, lzma.FORMAT_RAW, filters=_filters(literal_bits))[1:]
    for cut in range(len(_PADDING), 0, -1):
        with suppress(lzma.LZMAError):
            if len(data) >= cut and _inflated_lzma(data[:-cut], literal_bits, len(content)) == content:
                return data[:-cut]
    return data


def _inflated_lzma(data: bytes, literal_bits: int, most: int) -> bytes:
    opener = lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=_filters(literal_bits))
    return opener.decompress(b"\0" + data + _PADDING, most)


def _opened(coder: int, data: bytes, most: int) -> bytes:
    """The first ``most`` bytes that a coder made the data of, or all where they are fewer."""
    try:
        if coder == _PLAIN:
            return data[:most]
        if coder < _DEFLATE:
            return _inflated_lzma(data, _LITERAL_BITS[coder - 1], most)
        if coder == _DEFLATE:
            # Here zero means no limit.
            return zlib.decompressobj(-15).decompress(data, most) if most else b""
        return bz2.BZ2Decompressor().decompress(data, most)
    except (lzma.LZMAError, zlib.error, OSError, ValueError, EOFError) as error:
        raise InputError("The numbers cannot be decoded; the file is damaged.") from error
