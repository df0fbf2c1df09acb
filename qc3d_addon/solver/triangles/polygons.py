# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons of triangulated meshes: which triangles form one, and coverings that do not depend on the diagonals."""

from __future__ import annotations

import numpy as np

from ..arrays import Bools, Floats, Ints
from .geometry import face_normals
from .topology import among, distinct, face_adjacency

# Sine of the largest angle between the triangles of a flat face, and relative difference of equal squared lengths: far
# above what changes of a millionth of the size make of flat faces and equal sides.
_FLAT = 3e-4
_LONGER = 1e-3
# A polygon has fans from at most this many corners, evenly spaced: a disk with a thousand corners would otherwise need
# a million triangles.
_MOST_FANS = 16


def covering(faces: Ints, polygons: Ints) -> tuple[Ints, Floats]:
    """Triangles that cover each polygon evenly, whatever diagonals it was triangulated along.

    The covering is the mean of the fans from all corners: for a quad, both diagonals, with half the weight for each
    triangle. So it does not depend on the first corner, and a rotated or mirrored polygon has the rotated or mirrored
    covering. Polygons with many corners have fans from some of them only.

    Parameters
    ----------
    faces : (m, 3) int64
        Triangles.
    polygons : (m,) int64
        Label of the polygon of each triangle. Triangles with a common label that do not form one polygon stay as they
        are.

    Returns
    -------
    triangles : (k, 3) int64
        Oriented like the triangles of the polygon.
    shares : (k,)
        Weight of each triangle: 1 for a single one; those of a polygon with c corners sum to c - 2.
    """
    label = np.unique(polygons, return_inverse=True)[1].ravel()
    single = (np.bincount(label, minlength=1) == 1)[label]
    corners, starts, counts, kept = _loops(faces[~single], label[~single])
    alone = np.concatenate([faces[single], faces[~single][kept]])
    found, shares = [alone], [np.ones(len(alone))]
    for count in distinct(counts).tolist():
        places = _fans(count)
        loops = corners[starts[counts == count][:, None] + np.arange(count)]
        triangles = loops[:, places].reshape(-1, 3)
        found.append(triangles)
        shares.append(np.full(len(triangles), (count - 2) / len(places)))
    return np.concatenate(found), np.concatenate(shares)


def _fans(count: int) -> Ints:
    """(f, 3) corners of the fans' triangles in a polygon with ``count`` corners; each of a quad's is listed once."""
    apexes = np.arange(0, count, -(-count // _MOST_FANS))
    steps = np.arange(1, count - 1)
    fans = np.stack(np.broadcast_arrays(apexes[:, None], apexes[:, None] + steps, apexes[:, None] + steps + 1), axis=2)
    fans = fans.reshape(-1, 3) % count
    return np.asarray(fans[::2] if count == 4 else fans, dtype=np.int64)


def _loops(faces: Ints, label: Ints) -> tuple[Ints, Ints, Ints, Bools]:
    """The corners of all polygons in order, where each polygon starts, and its number of corners.

    Also, which triangles belong to no polygon, because the triangles with their label are not bounded by one loop.
    """
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    owner = np.tile(label, 3)
    span = int(faces.max(initial=0)) + 1
    tail, head = owner * span + directed[:, 0], owner * span + directed[:, 1]
    # The polygons' sides are those whose reverse does not belong to a triangle of the same polygon.
    number = np.unique(np.concatenate([tail, head]), return_inverse=True)[1].ravel()
    ends = number[: len(tail)] * (len(number) + 1) + number[len(tail) :]
    back = number[len(tail) :] * (len(number) + 1) + number[: len(tail)]
    outer = ~among(back, distinct(ends))
    tail, head, owner, point = tail[outer], head[outer], owner[outer], directed[outer, 0]
    order = np.argsort(tail, kind="stable")
    tail, head, owner, point = tail[order], head[order], owner[order], point[order]
    following = np.minimum(np.searchsorted(tail, head), max(0, len(tail) - 1))
    polygons = int(label.max(initial=-1)) + 1
    sides, triangles = np.bincount(owner, minlength=polygons), np.bincount(label, minlength=polygons)
    first = np.searchsorted(owner, np.arange(polygons))
    leads_on = (tail[following] == head) & (np.bincount(following, minlength=len(tail)) == 1)
    sound = np.bincount(owner, weights=leads_on, minlength=polygons) == sides
    sound &= (sides == triangles + 2) & (triangles > 0)
    # The distance from each side to the first side of its polygon, by pointer doubling.
    inside = sound[owner]
    root = np.zeros(len(tail), dtype=bool)
    root[first[sound]] = True
    jump = np.where(inside & ~root[following], following, np.arange(len(tail)))
    left = (jump != np.arange(len(tail))).astype(np.int64)
    for _ in range(int(sides.max(initial=1)).bit_length()):
        left, jump = left + left[jump], jump[jump]
    # If there are several loops, some sides never lead back to the first one.
    sound &= np.bincount(owner, weights=left, minlength=polygons) == sides * (sides - 1) // 2
    inside = sound[owner]
    order = np.lexsort((-left[inside], owner[inside]))
    counts = sides[sound]
    return point[inside][order], np.cumsum(counts) - counts, counts, ~sound[label]


def labels_by_sides(faces: Ints, polygons: Ints) -> Ints:
    """(m,) which of the polygons (p, c), short ones filled up with -1, each triangle is part of; -1 where of none.

    Determined by the sides that a triangle shares with its polygon; for a triangle without one, by its neighbors.
    """
    counts = (polygons >= 0).sum(axis=1)
    place = np.arange(polygons.shape[1])
    following = np.where(place[None] + 1 < counts[:, None], np.roll(polygons, -1, axis=1), polygons[:, :1])
    is_corner = place[None] < counts[:, None]
    span = int(max(faces.max(initial=0), polygons.max(initial=0))) + 1
    code = (polygons * span + following)[is_corner]
    owner = np.nonzero(is_corner)[0]
    order = np.argsort(code, kind="stable")
    code, owner = code[order], owner[order]
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    labels = np.full(len(faces), -1)
    # The triangles may turn the other way round; a side then is one of the polygon beside it as well.
    for first, second in ((0, 1), (1, 0)):
        for side in range(3):
            wanted = sides[:, side, first] * span + sides[:, side, second]
            found = np.minimum(np.searchsorted(code, wanted), max(0, len(code) - 1))
            told = np.flatnonzero((code[found] == wanted) & (labels < 0)) if len(code) else np.empty(0, dtype=np.int64)
            told = told[_are_corners(faces[told], polygons[owner[found[told]]])]
            labels[told] = owner[found[told]]
    neighbors = face_adjacency(faces)
    for _ in range(polygons.shape[1]):
        one, other = labels[neighbors].T
        new = (one < 0) != (other < 0)
        if not new.any():
            break
        untold = np.where(one < 0, neighbors[:, 0], neighbors[:, 1])[new]
        known = np.maximum(one, other)[new]
        fits = _are_corners(faces[untold], polygons[known])
        if not fits.any():
            break
        labels[untold[fits]] = known[fits]
    return labels


def _are_corners(triangles: Ints, polygons: Ints) -> Bools:
    """(k,) whether all corners of a triangle (k, 3) are corners of a polygon (k, c)."""
    return np.asarray((triangles[:, :, None] == polygons[:, None, :]).any(axis=2).all(axis=1))


def flat_quads(keys: list[Floats], faces: Ints) -> Ints:
    """(m,) guessed polygon of each triangle: two triangles that form a flat convex quad in all keys are one polygon.

    If a triangle could be joined across several sides, the one that is longest in all keys together is chosen.

    Parameters
    ----------
    keys : list of (n, 3)
        Positions in each key.
    faces : (m, 3) int64
        Triangles.
    """
    polygons = np.arange(len(faces))
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = sides.min(axis=1), sides.max(axis=1)
    order = np.lexsort((low > sides[:, 0], high, low))
    codes = (low * (int(faces.max(initial=0)) + 1) + high)[order]
    alike = codes[1:] == codes[:-1]
    # The side has exactly two triangles, with opposite directions.
    inner = alike & ~np.append(alike[1:], False) & ~np.append(False, alike[:-1])
    first, second = order[:-1][inner], order[1:][inner]
    forward = sides[first, 0] == sides[second, 1]
    first, second = first[forward], second[forward]
    quads = np.stack([sides[first, 0], _third(faces, second), sides[first, 1], _third(faces, first)], axis=1)
    joinable = np.ones(len(quads), dtype=bool)
    squares = np.zeros(len(quads))
    for key in keys:
        # Sizes near the ends of the range of floating point give infinities, which are not flat.
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = _in_unit_ball(key)
            joinable &= _flat_and_convex(scaled, quads)
            squares += ((scaled[quads[:, 2]] - scaled[quads[:, 0]]) ** 2).sum(axis=1)
    first, second, squares = first[joinable] % len(faces), second[joinable] % len(faces), squares[joinable]
    longest, times = np.zeros(len(faces)), np.zeros(len(faces), dtype=np.int64)
    for side in (first, second):
        np.maximum.at(longest, side, squares)
    for side in (first, second):
        np.add.at(times, side, squares >= (1.0 - _LONGER) * longest[side])
    best = np.ones(len(first), dtype=bool)
    for side in (first, second):
        best &= (squares >= (1.0 - _LONGER) * longest[side]) & (times[side] == 1)
    polygons[second[best]] = polygons[first[best]]
    return polygons


def _in_unit_ball(key: Floats) -> Floats:
    """(n, 3) positions (n, 3) around the first one, the farthest of them at the distance 1, however they are turned."""
    spread = key - key[:1]
    spread /= max(float(np.abs(spread).max(initial=0.0)), 1e-300)
    return np.asarray(spread / max(float(np.linalg.norm(spread, axis=1).max(initial=0.0)), 1e-300))


def _third(faces: Ints, sides: Ints) -> Ints:
    """The corners opposite to sides, where side k m + j is side k of triangle j."""
    triangle, which = sides % len(faces), sides // len(faces)
    return np.asarray(faces[triangle, (which + 2) % 3])


def _flat_and_convex(key: Floats, quads: Ints) -> Bools:
    """(q,) whether quads (q, 4) are planar and turn the same way at all four corners."""
    normals = np.stack([face_normals(key, np.roll(quads, -turn, axis=1)[:, :3]) for turn in range(4)])
    sizes = np.linalg.norm(normals, axis=2)
    along = normals.sum(axis=0)
    across = np.linalg.norm(np.cross(normals, along[None]), axis=2)
    turned = (normals * along[None]).sum(axis=2)
    return np.asarray(((sizes > 0.0) & (turned > 0.0) & (across <= _FLAT * turned)).all(axis=0))
