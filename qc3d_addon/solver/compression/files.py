# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps by the schemes that have names as files: versioned, self-contained up to the mesh, checked before all else.

A file is a header of fixed fields and three blocks: a fixed boundary's images, the numbers of the modes, and those of
the remainder. There are no names of files in it, no code and no pickled objects.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..errors import InputError
from ..files.npz import require_file, unreadable
from ..support.memory import require_memory_for_frames
from ..tets.mesh import TetMesh
from .compressed import Boundary, Compressed, Scheme
from .entropy import decoded
from .integers import inflated, packed, planes, unpacked
from .prediction import Predictor
from .range_coder import decoded as decoded_by_ranges

Kind = Literal["maps", "frames"]

# Magic, version, kind, scheme, boundary, the source's digest, its points, modes computed, maps, modes stored, points of
# the boundary, points of the remainder, bytes of the boundary and of the modes, both steps, the check, the placement.
# After version 1, the step of the boundary's displacements follows, or 0 for places that are exact.
_HEADER = struct.Struct("<8sHBBB16s8I3d4d")
_HELD_STEP = struct.Struct("<d")
_CHECKSUM = struct.Struct("<I")
_MAGIC, _VERSION = b"QC3DSPEC", 2
_MOST_BYTES = 2**30
MOST_NUMBERS = 2**24  # that are stored
MOST_COORDINATES = 2**28  # that the maps have
_MOST_MODES = 1000
KINDS_OF_SOURCES, _SCHEMES, _BOUNDARIES = get_args(Kind), get_args(Scheme), get_args(Boundary)


@dataclass(frozen=True, eq=False)
class Source:
    """What the file does not hold and its reader must have: the mesh.

    Parameters
    ----------
    kind : Kind
        ``maps`` of a tetrahedral mesh, or ``frames`` of a surface.
    points : (n, 3)
        Its vertices.
    cells : (m, 3 or 4)
        Its triangles or tetrahedra.
    """

    kind: Kind
    points: Floats
    cells: Ints

    @cached_property
    def digest(self) -> bytes:
        """16 bytes that tell meshes apart."""
        found = hashlib.sha256(np.ascontiguousarray(self.points, dtype="<f8").tobytes())
        found.update(np.ascontiguousarray(self.cells, dtype="<i8").tobytes())
        return found.digest()[:16]

    @cached_property
    def mesh(self) -> TetMesh:
        """The tetrahedra of maps."""
        return TetMesh(self.points, self.cells)

    @cached_property
    def boundary(self) -> Ints:
        """(b,) the vertices on the boundary of the tetrahedra."""
        return np.unique(self.mesh.boundary_faces)

    @cached_property
    def predictor(self) -> Predictor:
        """Predicts displacements from those around."""
        return Predictor(self.points)


@dataclass(frozen=True, eq=False)
class Content:
    """What a file holds.

    Parameters
    ----------
    modes : int
        How many modes were computed: the restoring needs as many.
    compressed : Compressed
    placement : tuple of four floats
        For frames: the corner and the scale that take them into the cube.
    """

    modes: int
    compressed: Compressed
    placement: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


class Packer:
    """Makes files of one source.

    Parameters
    ----------
    source : Source
    modes, placement
        See ``Content``.
    """

    def __init__(
        self, source: Source, modes: int, placement: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    ) -> None:
        self.source, self._modes, self._placement = source, modes, placement

    def bytes_of(self, compressed: Compressed) -> bytes:
        """The file."""
        return to_bytes(self.source, Content(self._modes, compressed, self._placement))

    def size(self, compressed: Compressed) -> int:
        """Its length."""
        return len(self.bytes_of(compressed))


def plain_bytes(numbers: NDArray[np.int64]) -> bytes:
    """Displacements (F, n, 3) as whole numbers, deflated and nothing else: what compression is compared with."""
    return zlib.compress(planes(numbers.transpose(0, 2, 1)), 9)


def to_bytes(source: Source, content: Content) -> bytes:
    """Compressed maps of a mesh as bytes; raises InputError for more numbers than a file may hold."""
    compressed = content.compressed
    count = compressed.numbers.size + compressed.held.size
    count += 0 if compressed.remainder is None else compressed.remainder.size
    if count > MOST_NUMBERS:
        raise InputError(f"{count} numbers are more than one file holds, {MOST_NUMBERS}; store fewer maps or frames.")
    if content.modes > _MOST_MODES:
        raise InputError(f"{content.modes} modes are more than one file may have, {_MOST_MODES}; use fewer.")
    if compressed.held_step:
        moved = (compressed.held - source.points[source.boundary]) / compressed.held_step
        boundary = packed(np.round(moved).astype(np.int64))
    else:
        boundary = zlib.compress(np.ascontiguousarray(compressed.held, dtype="<f8").tobytes(), 9)
    numbers = packed(compressed.numbers)
    remainder = b"" if compressed.remainder is None else packed(compressed.remainder, source.predictor)
    header = _HEADER.pack(
        _MAGIC,
        _VERSION,
        KINDS_OF_SOURCES.index(source.kind),
        _SCHEMES.index(compressed.scheme),
        _BOUNDARIES.index(compressed.boundary),
        source.digest,
        len(source.points),
        content.modes,
        len(compressed.numbers),
        compressed.numbers.shape[1],
        compressed.held.shape[1],
        0 if compressed.remainder is None else compressed.remainder.shape[1],
        len(boundary),
        len(numbers),
        compressed.step,
        compressed.remainder_step,
        compressed.check,
        *content.placement,
    )
    data = header + _HELD_STEP.pack(compressed.held_step) + boundary + numbers + remainder
    return data + _CHECKSUM.pack(zlib.crc32(data))


def from_bytes(data: bytes, source: Source) -> Content:
    """What ``to_bytes`` made, for the same source.

    Raises
    ------
    InputError
        If the data is damaged, of another version or kind, or of another mesh.
    """
    if len(data) < _HEADER.size + _CHECKSUM.size or data[:8] != _MAGIC:
        raise InputError("This is not a file of compressed maps.")
    fields = _HEADER.unpack_from(data)
    _, version, kind, scheme, boundary, digest = fields[:6]
    points, modes, count, stored, held, rest, held_bytes, number_bytes = fields[6:14]
    step, remainder_step, check = fields[14:17]
    if version not in (1, _VERSION):
        raise InputError(f"The compressed maps have version {version}; this program reads those up to {_VERSION}.")
    if _CHECKSUM.unpack(data[-_CHECKSUM.size :])[0] != zlib.crc32(data[: -_CHECKSUM.size]):
        raise InputError("The compressed maps are damaged: the checksum is wrong.")
    if kind >= len(KINDS_OF_SOURCES) or scheme >= len(_SCHEMES) or boundary >= len(_BOUNDARIES):
        raise InputError("The compressed maps are damaged: their header makes no sense.")
    if KINDS_OF_SOURCES[kind] != source.kind:
        raise InputError(f"The file holds {KINDS_OF_SOURCES[kind]}; give what these belong to.")
    if points != len(source.points) or digest != source.digest:
        raise InputError("The file was made for another mesh; give the one it belongs to.")
    body, held_step, decode = data[_HEADER.size : -_CHECKSUM.size], 0.0, decoded_by_ranges
    if version > 1:
        decode = decoded
        held_step = _HELD_STEP.unpack(body[: _HELD_STEP.size])[0] if len(body) >= _HELD_STEP.size else -1.0
        body = body[_HELD_STEP.size :]
    sound = (
        count > 0
        and stored <= modes <= _MOST_MODES
        and held <= points
        and rest in (0, points)
        and count * (6 * stored + 3 * held + 3 * rest) <= MOST_NUMBERS
        and 3 * count * points <= MOST_COORDINATES
        and held_bytes + number_bytes <= len(body)
        and np.isfinite([*fields[14:], held_step]).all()
        and held_step >= 0.0
        and held in (0, len(source.boundary) if held_step else held)
        and step >= 0.0 <= remainder_step
        and fields[20] > 0.0
    )
    if not sound:
        raise InputError("The compressed maps are damaged, or larger than can be read.")
    require_memory_for_frames(count, points)
    if held_step:
        moved = unpacked(body[:held_bytes], (count, held, 3))
        images = source.points[source.boundary] + held_step * moved if held else np.zeros((count, 0, 3))
    else:
        images = np.frombuffer(inflated(body[:held_bytes], 24 * count * held), "<f8").reshape(count, held, 3)
    if not np.isfinite(images).all():
        raise InputError("The compressed maps hold numbers that are not finite; the file is damaged.")
    numbers = unpacked(body[held_bytes : held_bytes + number_bytes], (count, stored, 6), decode=decode)
    left = body[held_bytes + number_bytes :]
    remainder = unpacked(left, (count, rest, 3), source.predictor, decode) if rest else None
    if left and not rest:
        raise InputError("There is more in the compressed maps than they say; the file is damaged.")
    compressed = Compressed(
        _SCHEMES[scheme],
        _BOUNDARIES[boundary],
        step,
        numbers,
        images.astype(np.float64),
        check,
        remainder_step,
        remainder,
        held_step,
    )
    return Content(modes, compressed, fields[17:21])


def read_bytes(path: Path) -> bytes:
    """Read a file of compressed maps; raises InputError if it cannot be read."""
    require_file(path, _MOST_BYTES)
    try:
        return path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from error
