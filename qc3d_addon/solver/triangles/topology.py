# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What hangs together in a triangle mesh: duplicate vertices, edges, connected and closed components."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints


def welded(
    key0: Floats, key1: Floats, reach: tuple[float, float] = (0.0, 0.0), edges: Ints | None = None
) -> tuple[Ints, Ints]:
    """Vertices that coincide in both keys (n, 3) count as one.

    Parameters
    ----------
    key0, key1 : (n, 3)
    reach : tuple of float
        How far apart along each axis vertices may be in the first and in the second key and still coincide.
    edges : (e, 2) int64, optional
        Ends of an edge are no copies of each other: a group with such a pair in it only holds what coincides exactly.

    Returns
    -------
    representatives : (k,) int64
        One vertex of each group.
    group : (n,) int64
        The group of every vertex: ``positions[representatives][group]`` are all positions, within the reach.
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
    # Groups in the order of the vertices keep sparse factors and reports in the mesh's own order.
    order = np.argsort(representatives)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return representatives[order].astype(np.int64), rank[group]


def _joined_groups(both: Floats, reach: tuple[float, float], edges: Ints | None) -> Ints:
    """(k,) labels of points (k, 6), in both keys, that are joined within the reach and have no edge among them."""
    count = len(both)
    # In a key that is squashed into a point everything would be near everything.
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
    """(k,) which points (n, 3) to keep, ascending: all, or, where more than ``most`` are in one place, one of each.

    Trees of points look at all that are in one place one by one, for every question.
    """
    along = np.sort(points[:, 0] + points[:, 1] * np.sqrt(2.0) + points[:, 2] * np.sqrt(3.0))
    if len(along) <= most or not (along[most:] == along[:-most]).any():
        return np.arange(len(points))
    _, first, counts = np.unique(points, axis=0, return_index=True, return_counts=True)
    kept: Ints = np.sort(first) if counts.max() > most else np.arange(len(points))
    return kept


def sides(faces: Ints) -> Ints:
    """(3m, 2) the three edges of every triangle, smaller index first; edge k*m + j belongs to face j."""
    return np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)


def distinct(numbers: Ints) -> Ints:
    """(k,) the numbers (n,) without repetition, sorted; many times faster than numpy's hashing from version 2.3 on."""
    ordered = np.sort(numbers)
    first = np.ones(len(ordered), dtype=bool)
    np.not_equal(ordered[1:], ordered[:-1], out=first[1:])
    kept: Ints = ordered[first]
    return kept


def among(numbers: Ints, known: Ints) -> Bools:
    """(n,) whether the numbers (n,) are among ``known`` (k,), which are sorted."""
    if not len(known):
        return np.zeros(len(numbers), dtype=bool)
    return np.asarray(known[np.minimum(np.searchsorted(known, numbers), len(known) - 1)] == numbers)


def unique_edges(edges: Ints) -> Ints:
    """(k, 2) edges without repetition and without loops."""
    low, high = edges.min(axis=1), edges.max(axis=1)
    span = int(high.max(initial=0)) + 1
    # One number for each edge sorts several times faster than pairs.
    codes = distinct((low * span + high)[low != high])
    return np.stack([codes // span, codes % span], axis=1)


def open_loops(faces: Ints) -> tuple[Ints, Ints]:
    """The vertices (k,) at edges that have one triangle, and for each the number of the loop that these edges make."""
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
    """(k, 2) pairs of triangles that share an edge; around an edge with many triangles they form a chain."""
    edges = sides(faces)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    return np.stack([owner[:-1][same], owner[1:][same]], axis=1)


def vertex_components(edges: Ints, count: int) -> Ints:
    """(count,) labels of the connected components of vertices joined by ``edges`` (k, 2)."""
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def closed_faces(faces: Ints, labels: Ints) -> Bools:
    """(m,) triangles of components that enclose a volume; ``labels`` are per vertex.

    Every edge has exactly two triangles there, whose normals agree: where they do not, the signed volume means nothing.
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
