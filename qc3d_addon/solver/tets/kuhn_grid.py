# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The unit cube in small cubes, each cut into six tetrahedra: a mesh that needs no shape, and no storing."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from .mesh import TetMesh

_JITTER = 0.15  # of a cell


def kuhn_grid(cells: int) -> TetMesh:
    """The unit cube in ``cells``^3 small cubes, each cut along its diagonal (Freudenthal, Kuhn)."""
    ticks = np.arange(cells + 1)
    grid = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    strides = np.array([(cells + 1) ** 2, cells + 1, 1])
    origins = grid[(grid < cells).all(axis=1)] @ strides
    walks = []
    for order in permutations(range(3)):
        corners = np.cumsum([0, *(strides[axis] for axis in order)])
        odd = np.linalg.det(np.eye(3)[list(order)]) < 0.0
        walks.append(corners[[0, 2, 1, 3]] if odd else corners)
    tets = (origins[:, None, None] + np.array(walks)).reshape(-1, 4)
    return TetMesh(grid / cells, tets.astype(np.int64))


def uneven_grid(cells: int) -> TetMesh:
    """The same with the vertices inside moved a little, the same way everywhere: it has no symmetry, so its modes are
    unique."""
    mesh = kuhn_grid(cells)
    # Weyl's sequence of whole numbers, spread over -1/2 .. 1/2.
    places = np.arange(mesh.points.size, dtype=np.uint64) * np.uint64(2654435761) % np.uint64(1 << 32)
    shift = _JITTER / cells * (places.astype(np.float64) / (1 << 32) - 0.5).reshape(-1, 3)
    return TetMesh(mesh.points + np.where(mesh.on_cube_face, 0.0, 2.0 * shift), mesh.tets)
