# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shapes that a bake wrote, stored with the shape keys so that the next bake knows what was sculpted since."""

from __future__ import annotations

import hashlib
import struct
import zlib
from contextlib import ExitStack

import bpy
import numpy as np
from numpy.typing import NDArray

from . import id_properties
from .names import MAX_STEPS
from .records import PROPERTY

_HEADER = struct.Struct("<4sII")  # magic number, number of shapes, number of vertices
_MAGIC = b"QCS1"

Shape = NDArray[np.float32]
# By the place on the control, since the number of a step changes with the number of steps.
Shapes = dict[float, Shape]


def keep(keys: bpy.types.Key, chain: str, base: Shape, shapes: Shapes, undo: ExitStack) -> None:
    """Store shapes (n, 3) by place, bit for bit, and the shape (n, 3) of the key that they are relative to."""
    stacked = np.ascontiguousarray([base, *shapes.values()], dtype="<f4").view("<u4")
    stacked[1:] ^= stacked[:1]  # most vertices do not move and become zeros, which compress well
    data = np.array(list(shapes), dtype="<f8").tobytes() + zlib.compress(stacked.tobytes(), 6)
    id_properties.put(keys, _property(chain), _HEADER.pack(_MAGIC, len(shapes), len(base)) + data, undo)


def read(keys: bpy.types.Key, chain: str, vertices: int) -> tuple[Shape, Shapes] | None:
    """The base and the shapes of a chain; None if there are none for a mesh with this number of vertices."""
    data = keys.get(_property(chain))
    if not isinstance(data, bytes) or len(data) < _HEADER.size:
        return None
    magic, count, kept_vertices = _HEADER.unpack_from(data)
    start = _HEADER.size + 8 * count
    if magic != _MAGIC or kept_vertices != vertices or not 0 <= count <= MAX_STEPS + 1 or len(data) < start:
        return None
    places = np.frombuffer(data, dtype="<f8", count=count, offset=_HEADER.size)
    size = 12 * (count + 1) * vertices
    try:
        raw = zlib.decompressobj().decompress(data[start:], size + 1)
    except zlib.error:
        return None
    if len(raw) != size or not np.isfinite(places).all():
        return None
    stacked = np.frombuffer(raw, dtype="<u4").reshape(count + 1, vertices, 3).copy()
    stacked[1:] ^= stacked[:1]
    base, *shapes = stacked.view("<f4")
    return base, dict(zip(places.tolist(), shapes, strict=True))


def vertices_before(keys: bpy.types.Key, chain: str) -> int | None:
    """Number of vertices of the mesh when the shapes of a chain were stored; None if there are none."""
    data = keys.get(_property(chain))
    if not isinstance(data, bytes) or len(data) < _HEADER.size:
        return None
    magic, _, vertices = _HEADER.unpack_from(data)
    return int(vertices) if magic == _MAGIC else None


def forget(keys: bpy.types.Key, chain: str, undo: ExitStack) -> None:
    """Remove the shapes of a chain."""
    id_properties.remove(keys, _property(chain), undo)


def _property(chain: str) -> str:
    return f"{PROPERTY}_shapes_{hashlib.sha256(chain.encode()).hexdigest()[:16]}"
