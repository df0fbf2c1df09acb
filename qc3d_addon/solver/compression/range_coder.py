# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole numbers as few bytes: an adaptive binary range coder (Martin 1979), whose models learn as they go.

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
# What is as good as certain still costs a little: no honest data holds more numbers in a byte.
MOST_PER_BYTE = 1 << 14

# Tells or takes a bit that a model expects; None for one that is as likely as not.
_Bit = Callable[[int, "list[int] | None"], int]


def encoded(numbers: NDArray[np.int64]) -> bytes:
    """Signed whole numbers (k,), each below 2^50, as bytes."""
    encoder = _Encoder()
    _Numbers(encoder.bit).run(np.asarray(numbers, dtype=np.int64).ravel().tolist())
    return encoder.finished()


def decoded(data: bytes, count: int) -> NDArray[np.int64]:
    """The ``count`` numbers that ``encoded`` made ``data`` of.

    Raises
    ------
    InputError
        If the data cannot hold as many, or means a number that is too large.
    """
    # The last four bytes may be left out where they are zeros.
    if count > MOST_PER_BYTE * (len(data) + 5):
        raise InputError(f"{len(data)} bytes cannot hold {count} numbers; the file is damaged.")
    return np.array(_Numbers(_Decoder(data).bit).run([0] * count), dtype=np.int64)


class _Numbers:
    """What is told of each number, the same for coding and decoding."""

    def __init__(self, bit: _Bit) -> None:
        self._bit = bit
        # Each model: how likely the bit 0 is, in 65536ths, and how many bits it has seen.
        self._models = [[_HALF, 0] for _ in range((_LARGEST_BITS + 1) * _CLASSES * (_STEPS + 1))]

    def run(self, numbers: list[int]) -> list[int]:
        """Code numbers, or, where the bits come from a decoder, put the numbers that they mean in their places."""
        recent = [0] * _WINDOW
        total = 0
        for place, number in enumerate(numbers):
            found = self._number(number, total)
            numbers[place] = found
            total += abs(found) - recent[place % _WINDOW]
            recent[place % _WINDOW] = abs(found)
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


class _Encoder:
    def __init__(self) -> None:
        self._low, self._range = 0, (1 << 32) - 1
        self._bytes = bytearray()

    def bit(self, bit: int, model: list[int] | None) -> int:
        bound = (self._range >> 16) * (_HALF if model is None else model[0])
        if bit:
            self._low += bound
            self._range -= bound
            self._carry()
        else:
            self._range = bound
        if model is not None:
            _learn(model, bit)
        while self._range < 1 << 24:
            self._bytes.append(self._low >> 24)
            self._low = (self._low & 0xFFFFFF) << 8
            self._range <<= 8
        return bit

    def finished(self) -> bytes:
        # Any value of the interval will do: the one with the most zeros at its end, which need not be written.
        for shift in range(32, -1, -1):
            value = -(-self._low >> shift) << shift
            if value < self._low + self._range:
                self._low = value
                break
        self._carry()
        return bytes(self._bytes) + self._low.to_bytes(4, "big").rstrip(b"\0")

    def _carry(self) -> None:
        if self._low >> 32:
            self._low &= (1 << 32) - 1
            place = len(self._bytes) - 1
            while self._bytes[place] == 255:
                self._bytes[place] = 0
                place -= 1
            self._bytes[place] += 1


class _Decoder:
    def __init__(self, data: bytes) -> None:
        self._data, self._place = data, 4
        self._code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")
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
            following = self._data[self._place] if self._place < len(self._data) else 0
            self._place += 1
            self._code = (self._code << 8 | following) & 0xFFFFFFFF
            self._range <<= 8
        return bit
