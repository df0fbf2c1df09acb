# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a surface, such as those of a baked chain, as maps of the cube: nothing but the first frame is needed back.

All frames are placed in the unit cube by one similarity. The cube is a regular grid of tetrahedra that no file has to
hold; a frame is the map of it that carries the first frame's vertices nearest, and a remainder.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..errors import InputError
from ..tets.kuhn_grid import uneven_grid
from ..tets.point_location import interpolation_matrix
from .codec import Codec
from .files import Content, Packer, Source
from .search import Compressor

MOST_MODES = 300
_CELLS = 10
_MARGIN = 0.15  # between the frames and the cube's faces

Placement = tuple[float, float, float, float]


def source_of(first: Floats, faces: Ints) -> Source:
    """What the reader of a file must have: the first frame's vertices (n, 3) and the faces (m, 3)."""
    return Source("frames", first, faces)


def compressor(frames: Floats, faces: Ints, modes: int) -> Compressor:
    """Compresses frames (F, n, 3), the first of which is not stored.

    Raises
    ------
    InputError
        If there are no frames, or these have no size.
    """
    if len(frames) < 2:
        raise InputError("There is nothing to store: the first frame is the source, and it has no frame after it.")
    corner = frames.min(axis=(0, 1))
    size = float(np.ptp(frames, axis=(0, 1)).max())
    if not size > 0.0:
        raise InputError("All vertices of all frames are in one place; there is nothing to store.")
    scale = (1.0 - 2.0 * _MARGIN) / size
    corner = corner - _MARGIN / scale
    placement = (float(corner[0]), float(corner[1]), float(corner[2]), scale)
    codec = _codec(frames[0], placement, modes)
    return Compressor(codec, placed(frames[1:], placement), Packer(source_of(frames[0], faces), modes, placement))


def restored(first: Floats, content: Content) -> Floats:
    """(F, n, 3) the frames, the first one included.

    Raises
    ------
    InputError
        If the content does not belong to the first frame, or this machine rebuilds other maps than the one that wrote.
    """
    inside = placed(first, content.placement)
    if content.compressed.scheme != "fitted" or content.compressed.boundary != "sliding":
        raise InputError("Frames are stored by the scheme fitted with sliding boundaries; the file is damaged.")
    if not ((inside > 0.0) & (inside < 1.0)).all() or content.modes > MOST_MODES:
        raise InputError("The first frame is not inside the cube of the file; the file is damaged.")
    codec = _codec(first, content.placement, content.modes)
    corner, scale = np.array(content.placement[:3]), content.placement[3]
    return np.concatenate([first[None], codec.restore(content.compressed) / scale + corner])


def placed(points: Floats, placement: Placement) -> Floats:
    """Points (..., 3) in the cube."""
    return np.asarray((points - np.array(placement[:3])) * placement[3])


def _codec(first: Floats, placement: Placement, modes: int) -> Codec:
    mesh = uneven_grid(_CELLS)
    return Codec(mesh, modes, observed=interpolation_matrix(mesh, placed(first, placement)))
