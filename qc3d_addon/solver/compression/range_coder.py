# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what version 1 of the file format holds: numbers by an adaptive binary range coder (Martin 1979).

A number is told as whether it is zero, how large it is, bit by bit, and its sign. What is likely depends on how large
the numbers just before it were: numbers that belong together stand together.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

_WINDOW = 6  # numbers before that tell what is likely
_STEPS = 12  # sizes that are learnt one by one; larger ones are rare
_CLASSES = 4  # of how large the numbers before were, relative to the bits that are not learnt
_LARGEST_BITS = 50
_HALF = 1 << 15
_MEMORY = 60  # how many bits back a model remembers, about
# What is as good as certain still costs a little: 61 of 65536ths are left to the other bit at last, so that no data
# holds more numbers in a byte.
MOST_PER_BYTE = 6000

# Tells or takes a bit that a model expects; None for one that is as likely as not.
_Bit = Callable[[int, "list[int] | None"], int]


def decoded(data: bytes, count: int) -> NDArray[np.int64]:
    """The ``count`` numbers, each below 2^50, that data means.

    Raises
    ------
    InputError
        If the data cannot hold as many, or means a number that is too large.
    """
    # The last four bytes may be left out where they are zeros.
    if count > MOST_PER_BYTE * (len(data) + 5):
        raise InputError(f"{len(data)} bytes cannot hold {count} numbers; the file is damaged.")
    decoder = _Decoder(data)
    return np.array(_Numbers(decoder.bit, decoder.zeros).run([0] * count), dtype=np.int64)


class _Numbers:
    """What is told of each number, the same for coding and decoding."""

    def __init__(self, bit: _Bit, zeros: Callable[[int, int], int] | None = None) -> None:
        self._bit, self._zeros = bit, zeros
        # Each model: how likely the bit 0 is, in 65536ths, and how many bits it has seen.
        self._models = [[_HALF, 0] for _ in range((_LARGEST_BITS + 1) * _CLASSES * (_STEPS + 1))]

    def run(self, numbers: list[int]) -> list[int]:
        """Code numbers, or, where the bits come from a decoder, put the numbers that they mean in their places."""
        recent = [0] * _WINDOW
        total = place = 0
        while place < len(numbers):
            if not total and self._zeros is not None and _has_settled(self._models[0]):
                # Millions of zeros after each other are all that little data can mean: they are taken in one go.
                place += self._zeros(self._models[0][0], len(numbers) - place)
                if place == len(numbers):
                    break
            found = self._number(numbers[place], total)
            numbers[place] = found
            total += abs(found) - recent[place % _WINDOW]
            recent[place % _WINDOW] = abs(found)
            place += 1
        return numbers

    def _number(self, number: int, total: int) -> int:
        # Bits far below the usual size are as likely 0 as 1.
        plain = max((total // _WINDOW).bit_length() - 2, 0)
        size = abs(number)
        base = (min(plain, _LARGEST_BITS) * _CLASSES + min((total >> plain).bit_length() // 2, _CLASSES - 1)) * (
            _STEPS + 1
        )
        high = self._high(size >> plain, base)
        low = 0
        for shift in range(plain - 1, -1, -1):
            low |= self._bit(size >> shift & 1, None) << shift
        size = high << plain | low
        if size >> _LARGEST_BITS:
            raise InputError("The data means numbers that are too large; the file is damaged.")
        return -size if size and self._bit(int(number < 0), None) else size

    def _high(self, size: int, base: int) -> int:
        for step in range(_STEPS):
            if not self._bit(int(size > step), self._models[base + step]):
                return step
        # The rest as an Exp-Golomb code.
        rest, length = size - _STEPS + 1, 0
        while self._bit(int(rest >> (length + 1) > 0), None):
            length += 1
            if length > _LARGEST_BITS:
                raise InputError("The data means numbers that are too large; the file is damaged.")
        found = 1
        for shift in range(length - 1, -1, -1):
            found = found << 1 | self._bit(rest >> shift & 1, None)
        return found + _STEPS - 1


def _learn(model: list[int], bit: int) -> None:
    likely, seen = model
    moved = likely + (2 * ((0 if bit else 1 << 16) - likely)) // (2 * seen + 3)
    model[0] = min(max(moved, 32), (1 << 16) - 32)
    model[1] = min(seen + 1, _MEMORY)


def _has_settled(model: list[int]) -> bool:
    """Whether one more bit 0 would teach the model nothing."""
    likely, seen = model
    return seen == _MEMORY and 2 * ((1 << 16) - likely) < 2 * seen + 3


class _Decoder:
    def __init__(self, data: bytes) -> None:
        # The encoder leaves out zeros among its last four bytes, and nothing is read beyond these.
        self._data, self._place = data + bytes(4), 4
        self._code = int.from_bytes(self._data[:4], "big")
        self._range = (1 << 32) - 1

    def bit(self, bit: int, model: list[int] | None) -> int:
        bound = (self._range >> 16) * (_HALF if model is None else model[0])
        bit = int(self._code >= bound)
        if bit:
            self._code -= bound
            self._range -= bound
        else:
            self._range = bound
        if model is not None:
            _learn(model, bit)
        while self._range < 1 << 24:
            self._code = (self._code << 8 | self._next()) & 0xFFFFFFFF
            self._range <<= 8
        return bit

    def zeros(self, likely: int, most: int) -> int:
        """Take as many bits 0 as follow each other, up to ``most``, where all are as likely; returns how many."""
        code, size = self._code, self._range
        taken = 0
        while taken < most:
            bound = (size >> 16) * likely
            if code >= bound:
                break
            size = bound
            taken += 1
            while size < 1 << 24:
                code = (code << 8 | self._next()) & 0xFFFFFFFF
                size <<= 8
        self._code, self._range = code, size
        return taken

    def _next(self) -> int:
        if self._place >= len(self._data):
            raise InputError("The data ends before the numbers that it should hold; the file is damaged.")
        self._place += 1
        return self._data[self._place - 1]
