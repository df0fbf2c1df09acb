# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices that no fold-free map can take from one key to the other: where a key crosses itself, and what lies inside.

Triangles that cross show only where a surface enters itself. What is deeper inside is found by winding numbers: without
the places that cross, the surface falls into pieces, each of which is inside or outside as a whole.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..collision.box_tree import CrowdedError
from ..collision.crossings import crossing_pairs
from ..collision.crossings_at_vertices import crossings_at_vertices
from ..keys.embedding import Embedding
from ..triangles.closed_volume import ClosedComponents
from ..triangles.geometry import areas
from ..triangles.topology import sides, unique_edges, vertex_components
from ..triangles.winding_number import exact_winding_numbers

_HALF = 0.5  # winding numbers of pieces are whole or half numbers


def crossing_vertices(embedding: Embedding) -> Bools:
    """(n,) whether a vertex is where a key crosses itself; no fold-free map meets both keys there.

    These are the vertices of triangles that cross in either key, also at a common vertex, and their neighbors; pieces
    of a closed component that are inside the component itself in either key; and pieces that are inside another closed
    component in one key only.
    True for all vertices if too many triangles overlap to be examined.

    Examples
    --------
    A tetrahedron that moves into another one, without touching it in either key:

    >>> from qc3d_addon.solver.keys.keypair import KeyPair
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> beside, inside = (np.concatenate([9.0 * corners, corners + shift]) for shift in (9.0, 1.0))
    >>> pair = KeyPair.checked(beside, inside, np.concatenate([faces, faces + 4]))
    >>> crossing_vertices(Embedding.of(pair))
    array([False, False, False, False,  True,  True,  True,  True])
    """
    faces, keys = embedding.pair.welded_faces, (embedding.key0, embedding.key1)
    found = np.zeros(len(embedding.key0), dtype=bool)
    for key in keys:
        try:
            crossing = np.concatenate([crossing_pairs(key, faces), crossings_at_vertices(key, faces)])
        except CrowdedError:
            return np.ones(len(found), dtype=bool)
        found[faces[crossing.ravel()].ravel()] = True
    found[faces[found[faces].any(axis=1)].ravel()] = True
    inside = _inside(keys, faces, found)
    # Vertices of welded seams share the fate of the one that stands for them.
    vertices, group = embedding.pair.welding
    return np.asarray((found | inside)[vertices][group] | found)


def _inside(keys: tuple[Floats, Floats], faces: Ints, crossing: Bools) -> Bools:
    """(n,) vertices of pieces, divided by the crossing vertices (n,), that are inside where they should not be."""
    result = np.zeros(len(crossing), dtype=bool)
    edges = unique_edges(sides(faces))
    components = vertex_components(edges, len(crossing))
    closed = ClosedComponents(faces, components)
    if not len(closed.faces):
        return result
    pieces = vertex_components(edges[~crossing[edges].any(axis=1)], len(crossing))
    whole = np.flatnonzero(~crossing[faces].any(axis=1))
    # One triangle of each piece, the largest, stands for all.
    order = whole[np.lexsort((-areas(keys[0], faces[whole]), pieces[faces[whole, 0]]))]
    _, first = np.unique(pieces[faces[order, 0]], return_index=True)
    chosen = order[first]
    # What is left without a triangle of its own is between places that cross.
    alone = np.isin(np.arange(len(crossing)), faces) & ~crossing
    alone[faces[whole]] = False
    result |= alone
    owners = components[faces[:, 0]]
    volumes = [closed.volumes(key) for key in keys]
    for component in np.unique(components[closed.faces[:, 0]]).tolist():
        own = owners == component
        corners = faces[own]
        middles = [key[faces[chosen]].mean(axis=1) for key in keys]
        near = np.logical_or.reduce([_in_box(middle, key[corners]) for middle, key in zip(middles, keys, strict=True)])
        mine = own[chosen]
        if mine.sum() == 1:
            near &= ~mine
        asked = np.flatnonzero(near)
        if not len(asked):
            continue
        place = np.where(mine[asked], (np.cumsum(own) - 1)[chosen[asked]], -1)
        numbers = [
            exact_winding_numbers(key, corners, middle[asked], place)
            for key, middle in zip(keys, middles, strict=True)
        ]
        # On the component itself, between 0 and 1 on a side: a half; the sign is that of its orientation.
        signs = [1.0 if volume[component] >= 0.0 else -1.0 for volume in volumes]
        deep = np.logical_or.reduce(
            [np.abs(sign * number - 0.5) > _HALF for sign, number in zip(signs, numbers, strict=True)]
        )
        elsewhere = np.abs(numbers[1] - numbers[0]) > _HALF
        wrong = np.where(mine[asked], deep, elsewhere)
        result |= np.isin(pieces, pieces[faces[chosen[asked[wrong]], 0]])
    return result


def _in_box(points: Floats, corners: Floats) -> Bools:
    """(k,) whether points (k, 3) are in the bounding box of triangles (m, 3, 3)."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    return np.asarray(((points >= low) & (points <= high)).all(axis=1))
