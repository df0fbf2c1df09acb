# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirror symmetry of a mesh: which vertex is the mirror image of which."""

from __future__ import annotations

from itertools import chain

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from ..errors import InputError

TOLERANCE = 1e-4  # of the bounding-box diagonal: what modeling by hand and saving in single precision leave

_LIKELY = 0.3  # of the mean length of a vertex's edges; beyond a half, other vertices are as near
_MOST_TOGETHER = 8  # candidates looked at for each vertex; no ordinary mesh has more vertices in one place


def mirror_partners(points: Floats, edges: Ints, axis: int = 0, tolerance: float = TOLERANCE) -> Ints:
    """For each vertex, the vertex that lies at its mirror image.

    Parameters
    ----------
    points : (n, 3)
        A shape that is symmetric about the plane where the coordinate ``axis`` is 0.
    edges : (e, 2) int64
        Edges of the mesh; they tell apart vertices that coincide, such as those of closed lips.
    axis : int
        0, 1 or 2.
    tolerance : float
        Largest distance between a vertex's mirror image and its partner, relative to the bounding-box diagonal.

    Returns
    -------
    (n,) int64
        Partners; the partner of a vertex's partner is that vertex.

    Raises
    ------
    InputError
        If some vertices have no partner; the message says how many.

    Examples
    --------
    >>> mirror_partners(np.array([[-1.0, 0, 0], [1.0, 0, 0], [0, 2.0, 0]]), np.array([[0, 2], [1, 2]]))
    array([1, 0, 2])
    """
    partners = known_partners(points, edges, axis, tolerance)
    lost = int((partners < 0).sum())
    if lost:
        raise InputError(
            f"{lost} of {len(points)} vertices have no mirror image across {'xyz'[axis]} = 0; the shape must be "
            "symmetric to be mirrored."
        )
    return partners


def known_partners(points: Floats, edges: Ints, axis: int = 0, tolerance: float = TOLERANCE) -> Ints:
    """(n,) the ``mirror_partners`` of a shape that is nearly symmetric; -1 where a vertex has none."""
    count = len(points)
    reach = tolerance * float(np.linalg.norm(np.ptp(points, axis=0)))
    images = points.copy()
    images[:, axis] *= -1.0
    distances, near = cKDTree(points).query(images, k=min(_MOST_TOGETHER, count), distance_upper_bound=reach)
    candidates = np.isfinite(np.reshape(distances, (count, -1)))
    near = np.reshape(near, (count, -1))
    found = candidates.sum(axis=1)
    partners = np.where(found == 1, near[:, 0], -1)
    together = np.flatnonzero(found > 1)
    if len(together):
        _settle(partners, {int(vertex): near[vertex, candidates[vertex]].tolist() for vertex in together}, edges)
    known = np.flatnonzero(partners >= 0)
    partners[known[partners[partners[known]] != known]] = -1
    return np.asarray(partners)


def likely_partners(points: Floats, edges: Ints, known: Ints, axis: int = 0) -> Ints:
    """More mirror partners of a shape that is symmetric only roughly, such as a scanned or a sculpted head.

    Two vertices are likely partners if each is the nearest one to the other's mirror image, within 0.3 of the mean
    length of its edges, and if all edges of one lead to partners of where the edges of the other lead.

    Parameters
    ----------
    points : (n, 3)
        The shape, roughly symmetric about the plane where the coordinate ``axis`` is 0.
    edges : (e, 2) int64
        Edges of the mesh.
    known : (n,) int64
        Known partners, and -1 elsewhere. They are kept.
    axis : int
        0, 1 or 2.

    Returns
    -------
    (n,) int64
        Partners, -1 for vertices without one; the partner of a vertex's partner is that vertex.

    Examples
    --------
    >>> line = np.array([[-1.1, 0, 0], [0.02, 0, 0], [1.0, 0.1, 0]])
    >>> likely_partners(line, np.array([[0, 1], [1, 2]]), np.array([-1, -1, -1]))
    array([2, 1, 0])
    """
    count = len(points)
    if not len(edges):
        return known
    images = points.copy()
    images[:, axis] *= -1.0
    distances, found = cKDTree(points).query(images)
    nearest = np.reshape(found, count)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    ends = np.bincount(edges.ravel(), minlength=count)
    mean = np.bincount(edges.ravel(), weights=np.repeat(lengths, 2), minlength=count) / np.maximum(ends, 1)
    fits = (distances < _LIKELY * mean) & (known < 0) & (known[nearest] < 0)
    partners: Ints = np.where(known >= 0, known, np.where(fits, nearest, -1))
    paired = np.flatnonzero(partners >= 0)
    partners[paired[partners[partners[paired]] != paired]] = -1
    codes = np.sort(edges, axis=1) @ [count, 1]
    there = np.sort(partners[edges], axis=1)
    is_edge = (there[:, 0] >= 0) & np.isin(there @ [count, 1], codes)
    good = np.bincount(edges.ravel(), weights=np.repeat(is_edge, 2), minlength=count) == ends
    likely = (known < 0) & (partners >= 0) & good & (ends > 0)
    partners[(known < 0) & ~(likely & likely[partners])] = -1
    return np.asarray(partners)


def _settle(partners: Ints, candidates: dict[int, list[int]], edges: Ints) -> None:
    """Choose among several candidates: the right one is joined by edges to the partners of the vertex's neighbors.

    Only for the few vertices that coincide with others; ``partners`` is filled in place.
    """
    involved = np.unique([*candidates, *chain.from_iterable(candidates.values())])
    touching = edges[np.isin(edges, involved).any(axis=1)]
    linked = {frozenset(edge) for edge in touching.tolist()}
    neighbors: dict[int, list[int]] = {}
    for first, second in touching.tolist():
        neighbors.setdefault(first, []).append(second)
        neighbors.setdefault(second, []).append(first)
    open_vertices = list(candidates)
    while open_vertices:
        left = []
        for vertex in open_vertices:
            known = [int(partners[other]) for other in neighbors.get(vertex, ()) if partners[other] >= 0]
            fits = [c for c in candidates[vertex] if known and all(frozenset((c, other)) in linked for other in known)]
            if len(fits) == 1:
                partners[vertex] = fits[0]
            else:
                left.append(vertex)
        if len(left) == len(open_vertices):
            return
        open_vertices = left
