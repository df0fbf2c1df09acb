# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Regular tetrahedral grids of the unit cube, which depend on nothing but their resolution."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from .mesh import TetMesh

_JITTER = 0.15  # of a cell: enough to break all symmetry, too little to invert a tetrahedron


def kuhn_grid(cells: int) -> TetMesh:
    """The unit cube in ``cells``³ small cubes, each cut into six tetrahedra around its diagonal (Freudenthal, Kuhn).

    Examples
    --------
    >>> mesh = kuhn_grid(2)
    >>> len(mesh.points), len(mesh.tets)
    (27, 48)
    """
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
    """A ``kuhn_grid`` whose inner vertices are shifted slightly, and reproducibly.

    It has no symmetry, so all eigenvalues of its Laplacian are simple and its modes are unique.
    """
    mesh = kuhn_grid(cells)
    # A Weyl sequence of integers, scaled to -1/2 .. 1/2.
    places = np.arange(mesh.points.size, dtype=np.uint64) * np.uint64(2654435761) % np.uint64(1 << 32)
    shift = _JITTER / cells * (places.astype(np.float64) / (1 << 32) - 0.5).reshape(-1, 3)
    return TetMesh(mesh.points + np.where(mesh.on_cube_face, 0.0, 2.0 * shift), mesh.tets)
