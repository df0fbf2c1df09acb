# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compressed maps as files: versioned, self-contained up to the mesh, and checked before anything is believed.

A file is a header, what it is about in fixed fields, and one compressed block: no names of files, no code, no pickled
objects.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from .array_files import replacing
from .compression import Boundary, Compressed, Scheme
from .errors import InputError
from .tetmesh import TetMesh
from .whole_numbers import deflated, inflated, packed, unpacked

# Magic, version, scheme, boundary, vertices, tetrahedra, modes, maps, bytes before compression, the mesh's digest.
_HEADER = struct.Struct("<8sHBBIIIIQ32s")
_CHECK = struct.Struct("<I")
_MAGIC, _VERSION = b"QC3DSPEC", 1
_MAP = struct.Struct("<dIIdI")  # step, modes, boundary vertices, step of the remainder, numbers of the remainder
_MOST_BYTES = 2**31
_SCHEMES, _BOUNDARIES = get_args(Scheme), get_args(Boundary)


@dataclass(frozen=True, eq=False)
class CompressedMaps:
    """Maps of one mesh, all by one scheme.

    Parameters
    ----------
    modes : int
        How many modes were computed: the restoring needs as many.
    maps : tuple of Compressed
    """

    modes: int
    maps: tuple[Compressed, ...]

    @property
    def scheme(self) -> Scheme:
        """The scheme of all maps."""
        return self.maps[0].scheme

    @property
    def boundary(self) -> Boundary:
        """What the boundary of all maps does."""
        return self.maps[0].boundary


def to_bytes(mesh: TetMesh, content: CompressedMaps) -> bytes:
    """Compressed maps of a mesh as bytes."""
    body = b"".join(_map_bytes(each) for each in content.maps)
    header = _HEADER.pack(
        _MAGIC,
        _VERSION,
        _SCHEMES.index(content.scheme),
        _BOUNDARIES.index(content.boundary),
        len(mesh.points),
        len(mesh.tets),
        content.modes,
        len(content.maps),
        len(body),
        digest(mesh),
    )
    data = header + deflated(body)
    return data + _CHECK.pack(zlib.crc32(data))


def from_bytes(data: bytes, mesh: TetMesh) -> CompressedMaps:
    """What ``to_bytes`` made, for the same mesh.

    Raises
    ------
    InputError
        If the data is damaged, of another version, or of another mesh.
    """
    if len(data) < _HEADER.size + _CHECK.size or data[:8] != _MAGIC:
        raise InputError("This is not a file of compressed maps.")
    fields = _HEADER.unpack_from(data)
    version, scheme, boundary, vertices, tets, modes, count, size, meshed = fields[1:]
    if version != _VERSION:
        raise InputError(f"The compressed maps have version {version}; this program reads version {_VERSION}.")
    if _CHECK.unpack(data[-_CHECK.size :])[0] != zlib.crc32(data[: -_CHECK.size]):
        raise InputError("The compressed maps are damaged: the checksum is wrong.")
    if (vertices, tets) != (len(mesh.points), len(mesh.tets)) or meshed != digest(mesh):
        raise InputError("The maps were compressed on another mesh; give the one they belong to.")
    most = count * (_MAP.size + 2 + 8 * (6 * modes + 6 * vertices))
    if scheme >= len(_SCHEMES) or boundary >= len(_BOUNDARIES) or not count or modes > vertices:
        raise InputError("The compressed maps are damaged: their header makes no sense.")
    if not size <= min(most, _MOST_BYTES):
        raise InputError("The compressed maps are damaged, or larger than can be read.")
    body = inflated(data[_HEADER.size : -_CHECK.size], size)
    if len(body) != size:
        raise InputError("The compressed maps end too early; the file is damaged.")
    maps = []
    for _ in range(count):
        found, used = _map_of(body, _SCHEMES[scheme], _BOUNDARIES[boundary], modes, vertices)
        maps.append(found)
        body = body[used:]
    if body:
        raise InputError("There is more in the compressed maps than they say; the file is damaged.")
    return CompressedMaps(modes, tuple(maps))


def write_compressed(path: Path, mesh: TetMesh, content: CompressedMaps) -> int:
    """Write a file whole or not at all; returns its size in bytes. Raises InputError if it cannot be written."""
    data = to_bytes(mesh, content)
    with replacing(path) as unfinished:
        try:
            unfinished.write_bytes(data)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error
    return len(data)


def read_compressed(path: Path, mesh: TetMesh) -> CompressedMaps:
    """Read a file of compressed maps of a mesh; raises InputError if it cannot be read or is something else."""
    try:
        size = path.stat().st_size
        if size > _MOST_BYTES:
            raise InputError(f"{path} has {size} bytes, more than compressed maps ever have.")
        return from_bytes(path.read_bytes(), mesh)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error


def digest(mesh: TetMesh) -> bytes:
    """32 bytes that tell meshes apart."""
    found = hashlib.sha256(np.ascontiguousarray(mesh.points, dtype="<f8").tobytes())
    found.update(np.ascontiguousarray(mesh.tets, dtype="<i8").tobytes())
    return found.digest()


def _map_bytes(compressed: Compressed) -> bytes:
    head = _MAP.pack(
        compressed.step,
        len(compressed.numbers),
        len(compressed.held),
        compressed.remainder_step,
        len(compressed.remainder),
    )
    # By channel: the modes of a channel fade out together.
    numbers = packed(compressed.numbers.T) + packed(compressed.remainder)
    return head + np.ascontiguousarray(compressed.held, dtype="<f8").tobytes() + numbers


def _map_of(
    data: bytes, scheme: Scheme, boundary: Boundary, modes: int, vertices: int
) -> tuple[Compressed, int]:
    """The map at the beginning of ``data``, and how many bytes it took."""
    if len(data) < _MAP.size:
        raise InputError("The compressed maps end too early; the file is damaged.")
    step, count, held, remainder_step, rest = _MAP.unpack_from(data)
    if count > modes or held > vertices or rest > 3 * vertices or len(data) < _MAP.size + 24 * held:
        raise InputError("The compressed maps are damaged: a map is larger than its mesh.")
    images = np.frombuffer(data, "<f8", 3 * held, _MAP.size).reshape(held, 3).astype(np.float64)
    if not (np.isfinite([step, remainder_step]).all() and step >= 0.0 <= remainder_step and np.isfinite(images).all()):
        raise InputError("The compressed maps hold numbers that are not finite; the file is damaged.")
    used = _MAP.size + 24 * held
    numbers, length = unpacked(data[used:], 6 * count)
    used += length
    remainder, length = unpacked(data[used:], rest)
    by_mode = numbers.reshape(6, count).T
    return Compressed(scheme, boundary, step, by_mode, images, remainder_step, remainder), used + length


def sizes(mesh: TetMesh, maps: Sequence[Compressed], modes: int) -> int:
    """How many bytes a file of these maps has."""
    return len(to_bytes(mesh, CompressedMaps(modes, tuple(maps))))
