# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirror partners by topology, for meshes whose positions are not symmetric: by the polygons around known partners."""

from __future__ import annotations

import numpy as np

from ..arrays import Ints
from .topology import distinct


def topology_partners(corners: Ints, starts: Ints, partners: Ints) -> Ints:
    """Further mirror partners, found by a breadth-first traversal of the polygons of both sides at once.

    If both ends of an edge have partners, the polygon on one side of the edge is the mirror image of the polygon on the
    other side of the partners' edge, provided that both have the same number of corners. The polygons around them
    follow in turn.

    Parameters
    ----------
    corners : (c,) int64
        The vertices of all polygons, one polygon after the other.
    starts : (p + 1,) int64
        Index of each polygon's first corner; the last entry is c.
    partners : (n,) int64
        Known partners, such as those of ``mirror_symmetry``, and -1 elsewhere. They are kept.

    Returns
    -------
    (n,) int64
        Partners, -1 for vertices without one; the partner of a vertex's partner is that vertex.
    """
    count = len(partners)
    sizes = np.diff(starts)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    place = np.arange(len(corners)) - starts[:-1][owner]

    def shifted(loops: Ints, step: Ints | int) -> Ints:
        polygon = owner[loops]
        return np.asarray(starts[:-1][polygon] + (place[loops] + step) % sizes[polygon])

    every = np.arange(len(corners))
    following = corners[shifted(every, 1)]
    codes, order = np.unique(corners * count + following, return_index=True)

    def along(first: Ints, second: Ints) -> Ints:
        """The corner at which the edge from one vertex to another begins; -1 if there is no such edge."""
        code = np.where((first >= 0) & (second >= 0), first * count + second, -1)
        found = np.minimum(np.searchsorted(codes, code), max(0, len(codes) - 1))
        return np.where(codes[found] == code, order[found], -1) if len(codes) else np.full(len(code), -1)

    result = partners.copy()
    seen = np.zeros(len(sizes), dtype=bool)
    own, other = every, along(result[following], result[corners])
    while True:
        fits = (own >= 0) & (other >= 0)
        own, other = own[fits], other[fits]
        fits = (sizes[owner[own]] == sizes[owner[other]]) & ~seen[owner[own]]
        own, other = own[fits], other[fits]
        _, first = np.unique(owner[own], return_index=True)
        own, other = own[first], other[first]
        if not len(own):
            break
        seen[owner[own]] = True
        next_own, next_other = [], []
        for step in range(int(sizes[owner[own]].max())):
            inside = step < sizes[owner[own]]
            mine, theirs = own[inside], other[inside]
            vertex, image = corners[shifted(mine, step)], corners[shifted(theirs, 1 - step)]
            new = (result[vertex] < 0) & (result[image] < 0)
            result[vertex[new]], result[image[new]] = image[new], vertex[new]
            after, before = corners[shifted(mine, step + 1)], corners[shifted(theirs, -step)]
            next_own.append(along(after, vertex))
            next_other.append(along(image, before))
        own, other = np.concatenate(next_own), np.concatenate(next_other)
    known = distinct(np.flatnonzero(result >= 0))
    lost = known[result[result[known]] != known]
    result[lost] = -1
    return result
