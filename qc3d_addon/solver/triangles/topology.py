# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Connectivity of triangle meshes: coincident vertices, edges, connected and closed components."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints


def welded(
    key0: Floats, key1: Floats, reach: tuple[float, float] = (0.0, 0.0), edges: Ints | None = None
) -> tuple[Ints, Ints]:
    """Group the vertices that coincide in both keys, as those of seams do.

    Parameters
    ----------
    key0, key1 : (n, 3)
        Positions in the first and in the second key.
    reach : tuple of float
        For each key, how far apart along any axis coincident vertices may be.
    edges : (e, 2) int64, optional
        The two ends of an edge are never grouped within the reach: a group that would contain an edge keeps only
        exactly coincident vertices together.

    Returns
    -------
    representatives : (k,) int64
        One vertex of each group, ascending.
    group : (n,) int64
        Group of every vertex; ``positions[representatives][group]`` equals ``positions`` within the reach.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.0, 0, 0]])
    >>> welded(points, points)
    (array([0, 1]), array([0, 1, 0]))
    """
    both = np.concatenate([key0, key1], axis=1)
    _, representatives, group = np.unique(both, axis=0, return_index=True, return_inverse=True)
    group = group.ravel()
    if max(reach) > 0.0:
        joined = _joined_groups(both[representatives], reach, group[edges] if edges is not None else None)
        count = int(joined.max(initial=-1)) + 1
        first = np.full(count, len(both))
        np.minimum.at(first, joined, representatives)
        representatives, group = first, joined[group]
    # Groups in the order of the vertices keep matrices and reports in the mesh's own order.
    order = np.argsort(representatives)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return representatives[order].astype(np.int64), rank[group]


def _joined_groups(both: Floats, reach: tuple[float, float], edges: Ints | None) -> Ints:
    """(k,) group of each point (k, 6), positions in both keys, joined within the reach unless edges forbid it."""
    count = len(both)
    # Search neighbors in the key that spreads further: in one that is squashed to a point, all vertices are neighbors.
    sizes = np.ptp(both, axis=0).reshape(2, 3).max(axis=1)
    key = int(np.argmin(np.divide(reach, sizes, out=np.full(2, np.inf), where=sizes > 0.0)))
    near = cKDTree(both[:, 3 * key : 3 * key + 3]).query_pairs(reach[key], p=np.inf, output_type="ndarray")
    apart = np.abs(both[near[:, 0]] - both[near[:, 1]])
    near = near[(apart <= np.repeat(reach, 3)).all(axis=1)]
    labels = vertex_components(near, count)
    if edges is not None and len(near):
        touching = (labels[edges[:, 0]] == labels[edges[:, 1]]) & (edges[:, 0] != edges[:, 1])
        torn = np.zeros(count, dtype=bool)
        torn[labels[edges[touching, 0]]] = True
        labels = vertex_components(near[~torn[labels[near[:, 0]]]], count)
    return labels


def without_piles(points: Floats, most: int) -> Ints:
    """(k,) indices of points (n, 3) to keep, ascending: all, or one of each place if more than ``most`` coincide.

    A k-d tree cannot split coincident points and visits all of them in every query.
    """
    along = np.sort(points[:, 0] + points[:, 1] * np.sqrt(2.0) + points[:, 2] * np.sqrt(3.0))
    if len(along) <= most or not (along[most:] == along[:-most]).any():
        return np.arange(len(points))
    _, first, counts = np.unique(points, axis=0, return_index=True, return_counts=True)
    kept: Ints = np.sort(first) if counts.max() > most else np.arange(len(points))
    return kept


def sides(faces: Ints) -> Ints:
    """(3m, 2) the three edges of each triangle (m, 3), smaller vertex first; row k m + j is edge k of triangle j."""
    return np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)


def distinct(numbers: Ints) -> Ints:
    """(k,) the distinct numbers (n,), sorted; many times faster than ``np.unique``, which hashes from numpy 2.3 on."""
    ordered = np.sort(numbers)
    first = np.ones(len(ordered), dtype=bool)
    np.not_equal(ordered[1:], ordered[:-1], out=first[1:])
    kept: Ints = ordered[first]
    return kept


def among(numbers: Ints, known: Ints) -> Bools:
    """(n,) whether each number (n,) is among the sorted numbers ``known`` (k,)."""
    if not len(known):
        return np.zeros(len(numbers), dtype=bool)
    return np.asarray(known[np.minimum(np.searchsorted(known, numbers), len(known) - 1)] == numbers)


def unique_edges(edges: Ints) -> Ints:
    """(k, 2) distinct edges, smaller vertex first, without loops."""
    low, high = edges.min(axis=1), edges.max(axis=1)
    span = int(high.max(initial=0)) + 1
    # Edges coded as single numbers sort several times faster than pairs.
    codes = distinct((low * span + high)[low != high])
    return np.stack([codes // span, codes % span], axis=1)


def edges_without_triangle(faces: Ints, wires: Ints, usable: Ints) -> Ints:
    """(k, 2) edges of no usable triangle: loose edges, and edges of triangles without an area."""
    every = unique_edges(np.concatenate([sides(faces), wires]))
    held = unique_edges(sides(usable))
    span = int(every.max(initial=0)) + 1
    covered = among(every[:, 0] * span + every[:, 1], held[:, 0] * span + held[:, 1])
    return np.asarray(every[~covered])


def open_loops(faces: Ints) -> tuple[Ints, Ints]:
    """The vertices (k,) of boundary edges, which have one triangle, and for each the label of its boundary loop."""
    edges = sides(faces)
    low, high = edges.T
    span = int(high.max(initial=0)) + 1
    codes = np.sort(low * span + high)
    alone = np.ones(len(codes), dtype=bool)
    alike = codes[1:] == codes[:-1]
    alone[1:] &= ~alike
    alone[:-1] &= ~alike
    rim = np.stack([codes[alone] // span, codes[alone] % span], axis=1)
    rim = rim[rim[:, 0] != rim[:, 1]]
    corners = distinct(rim.ravel())
    labels = vertex_components(np.searchsorted(corners, rim), len(corners))
    return corners, labels


def face_adjacency(faces: Ints) -> Ints:
    """(k, 2) pairs of triangles that share an edge; the triangles of a non-manifold edge are linked one to the next."""
    edges = sides(faces)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    return np.stack([owner[:-1][same], owner[1:][same]], axis=1)


def vertex_components(edges: Ints, count: int) -> Ints:
    """(count,) connected component, 0, 1, 2, ..., of each vertex in the graph with the given edges (k, 2)."""
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def closed_faces(faces: Ints, labels: Ints) -> Bools:
    """(m,) whether each triangle belongs to a component that encloses a volume; ``labels`` (n,) are by vertex.

    In such a component every edge has exactly two triangles with consistent orientation; otherwise a signed volume
    would have no meaning.
    """
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = directed.min(axis=1), directed.max(axis=1)
    edges, first, index, uses = np.unique(
        low * (int(high.max(initial=0)) + 1) + high, return_index=True, return_inverse=True, return_counts=True
    )
    forward = np.bincount(index.ravel(), weights=directed[:, 0] < directed[:, 1], minlength=len(edges))
    is_open = np.zeros(int(labels.max(initial=-1)) + 1, dtype=bool)
    is_open[labels[low[first[(uses != 2) | (forward != 1)]]]] = True
    return np.asarray(~is_open[labels[faces[:, 0]]])
