# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bisection: tetrahedra of a conforming mesh are halved at their longest edges, and maps of it stay what they are.

Every tetrahedron around an edge is halved together with it, so the mesh stays conforming (as in Rivara 1984,
*Algorithms for refining triangular grids suitable for adaptive and multigrid techniques*). A new point is in the middle
of its edge, and maps, which are linear on the edge, take the mean of its ends there. So their determinants stay.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from .mesh import TetMesh

_EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])


def bisected(mesh: TetMesh, marked: Bools, values: Floats) -> tuple[TetMesh, Floats, Ints]:
    """Halve marked tetrahedra at their longest edges, as many as can be halved at once.

    Of two chosen edges of one tetrahedron only the longer is halved; so some marked tetrahedra are left for a next
    round, and neighbors of marked tetrahedra are halved too.

    Parameters
    ----------
    mesh : TetMesh
    marked : (M,) bool
    values : (K, N, 3)
        Values of maps of the mesh.

    Returns
    -------
    mesh : TetMesh
        Its first N points are those of the mesh that was given.
    values : (K, N + P, 3)
    parents : (M + Q,) int64
        The tetrahedron that each one was a part of.

    Examples
    --------
    >>> from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid
    >>> cube = kuhn_grid(1)  # six tetrahedra around the diagonal, which is the longest edge of all
    >>> finer, _, parents = bisected(cube, np.arange(6) == 0, np.empty((0, 8, 3)))
    >>> len(finer.tets), finer.points[8], bool(abs(finer.volumes.sum() - 1.0) < 1e-15)
    (12, array([0.5, 0.5, 0.5]), True)
    """
    tets, count = mesh.tets, len(mesh.points)
    touched = np.zeros(count, dtype=bool)
    touched[tets[marked]] = True
    near = np.flatnonzero(touched[tets].any(axis=1))  # among them are all tetrahedra around the edges of marked ones
    pairs = np.sort(tets[near][:, _EDGES], axis=2)
    edges, edge_of = np.unique(pairs[..., 0] * count + pairs[..., 1], return_inverse=True)
    edge_of = edge_of.reshape(-1, 6)
    first, second = edges // count, edges % count
    lengths = np.linalg.norm(mesh.points[second] - mesh.points[first], axis=1)
    rank = np.empty(len(edges), dtype=np.int64)
    rank[np.lexsort((edges, lengths))] = np.arange(len(edges))
    longest = edge_of[np.arange(len(near)), rank[edge_of].argmax(axis=1)]
    chosen = np.zeros(len(edges), dtype=bool)
    chosen[longest[marked[near]]] = True
    ranked = np.where(chosen, rank, -1)[edge_of]
    chosen[edge_of[(ranked >= 0) & (ranked < ranked.max(axis=1, keepdims=True))]] = False
    halved = np.flatnonzero(chosen)
    middle = np.full(len(edges), -1, dtype=np.int64)
    middle[halved] = count + np.arange(len(halved))
    found = chosen[edge_of]
    local = np.flatnonzero(found.any(axis=1))
    edge = found[local].argmax(axis=1)
    new = middle[edge_of[local, edge]]
    rows = np.arange(len(local))
    one, other = tets[near[local]], tets[near[local]]
    one[rows, _EDGES[edge, 0]] = new
    other[rows, _EDGES[edge, 1]] = new
    left = np.setdiff1d(np.arange(len(tets)), near[local], assume_unique=True)
    ends = first[halved], second[halved]
    points = np.concatenate([mesh.points, 0.5 * (mesh.points[ends[0]] + mesh.points[ends[1]])])
    values = np.concatenate([values, 0.5 * (values[:, ends[0]] + values[:, ends[1]])], axis=1)
    parents = np.concatenate([left, near[local], near[local]])
    return TetMesh(points, np.concatenate([tets[left], one, other])), values, parents
