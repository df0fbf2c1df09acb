# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of displacements: a header of a few bytes, the numbers, a checksum. Nothing in them is believed unchecked.

Version 3 of the file format; versions 1 and 2 (module ``files``) hold the schemes that have names.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from ..arrays import Floats
from ..errors import InputError
from ..support.memory import require_memory_for_frames
from .entropy import decoded, encoded
from .fields import GROWTHS, KINDS, ORDERS, Field, Part, Space, check_of, length_of_stream
from .files import KINDS_OF_SOURCES, MOST_COORDINATES, MOST_NUMBERS, Kind, Source
from .graph_modes import MOST_MODES
from .integers import inflated

Boundary = Literal["sliding", "fixed", "exact"]

_BOUNDARIES: tuple[Boundary, ...] = get_args(Boundary)
_MAGIC = b"QC3\x03"
_DIGEST = 2  # bytes
_FLOAT, _CHECKSUM = struct.Struct("<f"), struct.Struct("<I")
_MOST_BITS = 40  # of factors
_MOST_SETTINGS = 4096
_HAS_FACTORS, _IS_REMADE, _IS_UNFOLDED = 1 << 5, 1 << 3, 1 << 4
# The modes of two machines differ by rounding, or by far more than this share of a step.
_CHECK_SHARE, _CHECK_ROUNDING = 0.02, 1e-6
_DAMAGED = "The compressed data is damaged: its header makes no sense."


@dataclass(frozen=True, eq=False)
class Remaking:
    """What frames are made again from, beside the first one.

    Parameters
    ----------
    settings : bytes
        The settings of the bake; see ``frames.remade``.
    keys : Field
        Displacements of the later keys from the first.
    error : float
        The error that was asked for; the frames that are made again must be as near as a small part of it.
    check : float
        A sum over the frames that were made again, see ``check_of``.
    """

    settings: bytes
    keys: Field
    error: float
    check: float


@dataclass(frozen=True, eq=False)
class Packed:
    """What a file holds.

    Parameters
    ----------
    kind : Kind
    boundary : Boundary
        Of maps: on the faces of the cube; as all else; or its places exactly.
    count : int
        Number of maps or frames.
    field : Field
        Displacements from the mesh, or from what is made again.
    exact : (F, b, 3), optional
        The places of the boundary's vertices, where they are exact.
    remaking : Remaking, optional
    is_unfolded : bool
        Whether maps are to be unfolded once they are restored.
    """

    kind: Kind
    boundary: Boundary
    count: int
    field: Field
    exact: Floats | None = None
    remaking: Remaking | None = None
    is_unfolded: bool = False


def is_compact(data: bytes) -> bool:
    """Whether these are the bytes of such a file, of whichever version."""
    return data[:3] == _MAGIC[:3] and data[:4] != b"QC3D"


def space_of(source: Source, boundary: Boundary) -> Space:
    """Where displacements belong, and which are known to be 0."""
    if source.kind == "frames" or boundary == "fixed":
        return Space(source.points, source.cells)
    if boundary == "sliding":
        return Space(source.points, source.cells, ~source.mesh.on_cube_face)
    free = np.ones(source.points.shape, dtype=bool)
    free[source.boundary] = False
    return Space(source.points, source.cells, free)


def to_bytes(source: Source, space: Space, packed: Packed) -> bytes:
    """The file of displacements of a source."""
    flags = KINDS_OF_SOURCES.index(packed.kind) | _BOUNDARIES.index(packed.boundary) << 1
    flags |= (0 if packed.remaking is None else _IS_REMADE) | (_IS_UNFOLDED if packed.is_unfolded else 0)
    head = _MAGIC + source.digest[:_DIGEST] + bytes([flags]) + _varint(packed.count)
    blocks = []
    if packed.exact is not None:
        table = np.ascontiguousarray(packed.exact, dtype="<f8").view(np.uint8).reshape(-1, 8)
        blocks.append(_sized(zlib.compress(np.ascontiguousarray(table.T).tobytes(), 9)))
    if packed.remaking is not None:
        remaking = packed.remaking
        keys = _field_bytes(space, remaking.keys)
        blocks += [_sized(remaking.settings), _FLOAT.pack(remaking.error), _FLOAT.pack(remaking.check), _sized(keys)]
    data = head + b"".join(blocks) + _field_bytes(space, packed.field)
    return data + _CHECKSUM.pack(zlib.crc32(data))


def from_bytes(data: bytes, source: Source, most_keys: int = 64) -> tuple[Packed, Space]:
    """What ``to_bytes`` made, for the same source, and where its displacements belong.

    Raises
    ------
    InputError
        If the data is damaged, of another version or kind, of another mesh, or more than can be read.
    """
    if not is_compact(data):
        raise InputError("This is not a file of compressed maps.")
    if data[:4] != _MAGIC:
        raise InputError(f"The file has version {data[3] if len(data) > 3 else '?'}; this program reads {_MAGIC[3]}.")
    if len(data) < 12 or _CHECKSUM.unpack(data[-4:])[0] != zlib.crc32(data[:-4]):
        raise InputError("The compressed data is damaged: the checksum is wrong.")
    reader = _Reader(data[4:-4])
    digest, flags, count = reader.take(_DIGEST), reader.take(1)[0], reader.varint()
    kind, number, rest = KINDS_OF_SOURCES[flags & 1], flags >> 1 & 3, flags >> 5
    of_the_other = _IS_REMADE if kind == "maps" else _IS_UNFOLDED
    if number >= len(_BOUNDARIES) or rest or (kind == "frames" and number) or flags & of_the_other:
        raise InputError(_DAMAGED)
    if kind != source.kind:
        raise InputError(f"The file holds {kind}; give what these belong to.")
    if digest != source.digest[:_DIGEST]:
        raise InputError("The file was made for another mesh; give the one it belongs to.")
    if not count or 3 * count * len(source.points) > MOST_COORDINATES:
        raise InputError("The compressed data is damaged, or larger than can be read.")
    require_memory_for_frames(count, len(source.points))
    boundary = _BOUNDARIES[number]
    space, exact, remaking = space_of(source, boundary), None, None
    if boundary == "exact":
        size = 24 * count * len(source.boundary)
        table = np.frombuffer(inflated(reader.take(reader.varint()), size), np.uint8).reshape(8, -1)
        exact = np.ascontiguousarray(table.T).view("<f8").reshape(count, -1, 3).astype(np.float64)
        if not np.isfinite(exact).all():
            raise InputError("The compressed data holds numbers that are not finite; the file is damaged.")
    if flags & _IS_REMADE:
        settings = reader.take(reader.varint(_MOST_SETTINGS))
        error, check = reader.number(), reader.number()
        keys = reader.varint()
        block = _Reader(reader.take(keys))
        field = _read_field(block, space, None, most_keys)
        remaking = Remaking(settings, field, error, check)
    field = _read_field(reader, space, count, count)
    return Packed(kind, boundary, count, field, exact, remaking, bool(flags & _IS_UNFOLDED)), space


def _field_bytes(space: Space, field: Field) -> bytes:
    part, factors = field.part, field.factors
    flags = KINDS.index(part.kind) | part.option << 2 | (0 if factors is None else _HAS_FACTORS)
    data = bytes([flags]) + _varint(len(part.numbers)) + _FLOAT.pack(part.step)
    if factors is not None:
        data += bytes([field.factor_bits]) + _varint(len(factors)) + _sized(encoded(factors))
    if part.kind == "modes":
        data += _varint(part.numbers.shape[1]) + _FLOAT.pack(check_of(part.field(space)))
    return data + encoded(part.stream(space))


def _read_field(reader: _Reader, space: Space, count: int | None, most: int) -> Field:
    """A field of ``count`` displacements, or of at most ``most``; it takes all that the reader has."""
    flags = reader.take(1)[0]
    number, option = flags & 3, flags >> 2 & 7
    rows, step = reader.varint(), reader.number()
    options = {"plain": 2 * ORDERS, "levels": len(GROWTHS), "modes": 1}
    if number >= len(KINDS) or option >= options[KINDS[number]] or flags >> 6 or not 0 < rows <= most or step < 0.0:
        raise InputError(_DAMAGED)
    kind, factors, bits, displacements = KINDS[number], None, 0, rows
    if flags & _HAS_FACTORS:
        bits, displacements = reader.take(1)[0], reader.varint()
        block = reader.take(reader.varint())
        if bits > _MOST_BITS or not 0 < displacements <= most or rows * displacements > MOST_NUMBERS:
            raise InputError(_DAMAGED)
        factors = decoded(block, rows * displacements).reshape(displacements, rows)
    modes, check = 0, 0.0
    if kind == "modes":
        modes, check = reader.varint(), reader.number()
        if not 0 < modes <= min(MOST_MODES, space.most_modes):
            raise InputError(_DAMAGED)
    length = length_of_stream(space, kind, rows, modes) if step else 0
    if displacements != (count or displacements) or max(length, 3 * rows * len(space.points)) > MOST_NUMBERS:
        raise InputError("The compressed data is damaged, or larger than can be read.")
    part = Part.of_stream(space, kind, option, step, rows, decoded(reader.rest(), length))
    if part.kind == "modes":
        made = part.field(space)
        tolerance = max(_CHECK_SHARE * step / np.sqrt(made.size), _CHECK_ROUNDING * abs(check))
        if not abs(check_of(made) - check) <= tolerance:
            raise InputError(
                "The mesh's modes come out differently than where the file was made; it is damaged, or was made on a "
                "machine with other libraries."
            )
    return Field(part, factors, bits)


class _Reader:
    """Takes bytes from the front; InputError where there are not as many."""

    def __init__(self, data: bytes) -> None:
        self._data, self._place = data, 0

    def take(self, count: int) -> bytes:
        if count > len(self._data) - self._place:
            raise InputError("The compressed data ends too early; the file is damaged.")
        self._place += count
        return self._data[self._place - count : self._place]

    def rest(self) -> bytes:
        return self.take(len(self._data) - self._place)

    def number(self) -> float:
        value = float(_FLOAT.unpack(self.take(_FLOAT.size))[0])
        if not np.isfinite(value):
            raise InputError("The compressed data holds numbers that are not finite; the file is damaged.")
        return value

    def varint(self, most: int = 2**32) -> int:
        value = 0
        for shift in range(0, 35, 7):
            byte = self.take(1)[0]
            value |= (byte & 127) << shift
            if byte < 128:
                break
        else:
            raise InputError(_DAMAGED)
        if value > most:
            raise InputError(_DAMAGED)
        return value


def _varint(value: int) -> bytes:
    data = bytearray()
    while value > 127:
        data.append(value & 127 | 128)
        value >>= 7
    return bytes(data + bytes([value]))


def _sized(block: bytes) -> bytes:
    return _varint(len(block)) + block
