# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The distortion measures of a bake, stored compactly with the shape keys for the heat map."""

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

MEASURES = ("stretch", "volume", "dilatation")

_HEADER = struct.Struct("<4sII")  # magic number, number of frames, number of vertices
_MAGIC = b"QCM1"

Measures = dict[str, NDArray[np.float32]]


def keep(keys: bpy.types.Key, slider: str, measures: Measures, undo: ExitStack) -> None:
    """Store measures (k, n) by name; they are ratios, stored as half-precision logarithms, to about a thousandth."""
    count, vertices = measures[MEASURES[0]].shape
    logarithms = np.log2(np.clip(np.stack([measures[name] for name in MEASURES]), 2.0**-20, 2.0**20))
    data = zlib.compress(np.ascontiguousarray(logarithms, dtype="<f2").tobytes(), 6)
    id_properties.put(keys, _property(slider), _HEADER.pack(_MAGIC, count, vertices) + data, undo)


def read(keys: bpy.types.Key, slider: str, vertices: int) -> Measures | None:
    """The measures of a slider; None if there are none for a mesh with this number of vertices."""
    data = keys.get(_property(slider))
    if not isinstance(data, bytes) or len(data) < _HEADER.size:
        return None
    magic, count, kept_vertices = _HEADER.unpack_from(data)
    if magic != _MAGIC or kept_vertices != vertices or not 2 <= count <= MAX_STEPS + 1:
        return None
    size = 2 * len(MEASURES) * count * vertices
    try:
        raw = zlib.decompressobj().decompress(data[_HEADER.size :], size + 1)
    except zlib.error:
        return None
    if len(raw) != size:
        return None
    logarithms = np.frombuffer(raw, dtype="<f2").reshape(len(MEASURES), count, vertices)
    values = np.exp2(logarithms.astype(np.float32))
    return dict(zip(MEASURES, values, strict=True)) if np.isfinite(values).all() else None


def forget(keys: bpy.types.Key, slider: str, undo: ExitStack) -> None:
    """Remove the measures of a slider."""
    id_properties.remove(keys, _property(slider), undo)


def has(keys: bpy.types.Key, slider: str) -> bool:
    """Whether there are measures of a slider. Fast enough for a panel."""
    return id_properties.has(keys, _property(slider))


def _property(slider: str) -> str:
    return f"{PROPERTY}_measures_{hashlib.sha256(slider.encode()).hexdigest()[:16]}"
