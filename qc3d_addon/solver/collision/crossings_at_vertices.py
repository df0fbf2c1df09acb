# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles with one common vertex that cross each other: where the surface passes through itself right at a vertex."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .box_tree import CrowdedError
from .crossings import TOUCHING, pierced

_AT_ONCE = 200_000  # pairs
_MOST = 20_000_000  # pairs, of which there are as many as the squares of the numbers of triangles around vertices


def crossings_at_vertices(points: Floats, faces: Ints) -> Ints:
    """Pairs of triangles that share exactly one vertex and cross in a shape.

    Parameters
    ----------
    points : (n, 3)
    faces : (m, 3) int64

    Returns
    -------
    (k, 2) int64
        In each pair, the first triangle is pierced by the edge of the second that is opposite the common vertex.

    Raises
    ------
    CrowdedError
        If so many triangles meet at vertices that comparing them would take too long.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 1, -1], [0.4, 0.4, 1]])
    >>> crossings_at_vertices(points, np.array([[0, 1, 2], [0, 3, 4]]))
    array([[0, 1]])
    """
    corners = faces.ravel()
    order = np.argsort(corners, kind="stable")
    vertices = corners[order]
    starts = np.searchsorted(vertices, np.arange(len(points) + 1))
    partners = np.diff(starts)[vertices]  # of each corner: those around the same vertex
    ends = np.cumsum(partners)
    if len(ends) and ends[-1] > _MOST:
        raise CrowdedError(
            "So many triangles meet at one vertex that comparing them would take too long; remove some of them."
        )
    depth = TOUCHING * float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
    found = [np.empty((0, 2), dtype=np.int64)]
    for low in range(0, int(ends[-1]) if len(ends) else 0, _AT_ONCE):
        pair = np.arange(low, min(low + _AT_ONCE, int(ends[-1])))
        first = np.searchsorted(ends, pair, side="right")
        second = starts[vertices[first]] + pair - (ends[first] - partners[first])
        one, other = order[first] // 3, order[second] // 3
        shared = (faces[one][:, :, None] == faces[other][:, None, :]).sum(axis=(1, 2))
        single = shared == 1
        one, other = one[single], other[single]
        first_corners, second_corners = (points[faces[which]].transpose(2, 1, 0) for which in (one, other))
        crossing = pierced(first_corners, second_corners, depth)
        found.append(np.stack([one[crossing], other[crossing]], axis=1))
    return np.concatenate(found)
