# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Consistent branches of rotation vectors over a mesh: turns beyond 180 degrees, and neighbours that agree.

The rotation of one element tells its angle only up to full turns. Neighbouring elements turn alike, so the branch is
carried from element to element along a spanning tree that crosses the smallest relative rotations first.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from .rotations import nearest_branch
from .tetmesh import Floats, Ints


def consistent_branches(turns: Floats, adjacency: Ints) -> Floats:
    """Rotation vectors (m, 3) with full turns added so that neighbours agree.

    Parameters
    ----------
    turns : (m, 3)
        Rotation vectors, angles in [0, pi].
    adjacency : (k, 2) int64
        Pairs of neighbouring elements.

    Returns
    -------
    (m, 3) rotation vectors of the same rotations. In each connected part the element that turns least keeps its
    angle.
    """
    count = len(turns)
    if not count:
        return turns.copy()
    first, second = adjacency.T
    # A relative rotation of zero must still count as an edge of the graph.
    cost = _relative_angles(turns[first], turns[second]) + 1e-9
    graph = coo_array((cost, (first, second)), shape=(count, count)).tocsr()
    tree = minimum_spanning_tree(graph)
    parts, labels = connected_components(tree, directed=False)
    angles = np.linalg.norm(turns, axis=1)
    by_angle = np.lexsort((angles, labels))
    roots = by_angle[np.searchsorted(labels[by_angle], np.arange(parts))]
    return _carried_from(roots, tree, turns)


def _carried_from(roots: Ints, tree: csr_array, turns: Floats) -> Floats:
    """Walk the spanning forest outwards from the roots, a whole generation at a time."""
    count = len(turns)
    # One more node joins all roots, so that one search covers every part.
    rows, columns = tree.nonzero()
    rows = np.concatenate([rows, np.full(len(roots), count)])
    columns = np.concatenate([columns, roots])
    joined = coo_array((np.ones(len(rows)), (rows, columns)), shape=(count + 1, count + 1)).tocsr()
    order, parents = (found.astype(np.int64) for found in breadth_first_order(joined, count, directed=False))
    depth = _depths(order, parents)
    result = turns.copy()
    by_depth = order[np.argsort(depth[order], kind="stable")]
    starts = np.searchsorted(depth[by_depth], np.arange(2, depth.max() + 2))
    for begin, end in pairwise(starts):
        members = by_depth[begin:end]
        result[members] = nearest_branch(turns[members], result[parents[members]])
    return result


def _depths(order: Ints, parents: Ints) -> Ints:
    """Distance from the root of every node of a breadth-first order, by pointer doubling."""
    ancestor = parents.copy()
    ancestor[order[0]] = order[0]
    depth = np.ones(len(parents), dtype=np.int64)
    depth[order[0]] = 0
    while True:
        further = depth[ancestor]
        if not further.any():
            return depth
        depth = depth + further
        ancestor = ancestor[ancestor]


def _relative_angles(first: Floats, second: Floats) -> Floats:
    """(k,) angles between the rotations of two lists of rotation vectors, from their quaternions."""
    scalars, vectors = zip(*(_half_angle(vector) for vector in (first, second)), strict=True)
    inner = scalars[0] * scalars[1] + np.einsum("ki,ki->k", vectors[0], vectors[1])
    return np.asarray(2.0 * np.arccos(np.clip(np.abs(inner), 0.0, 1.0)))


def _half_angle(vectors: Floats) -> tuple[Floats, Floats]:
    half = 0.5 * np.linalg.norm(vectors, axis=1)
    return np.cos(half), 0.5 * np.sinc(half / np.pi)[:, None] * vectors
