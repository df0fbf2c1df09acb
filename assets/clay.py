# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes as signed distances, negative inside, blended like clay, and their surfaces as meshes of quads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Field = Callable[[Floats], Floats]  # points (n, 3) to signed distances (n,)

_ROUNDS = 6  # of smoothing and projection: after these, the quads are even and lie on the surface


def ball(points: Floats, center: Sequence[float], radii: Sequence[float]) -> Floats:
    """(n,) roughly the distance to an ellipsoid: exact on its surface and for spheres."""
    offset = points - np.array(center)
    scaled = np.linalg.norm(offset / np.array(radii), axis=1)
    gradient = np.linalg.norm(offset / np.square(radii), axis=1)
    return np.asarray(scaled * (scaled - 1.0) / np.maximum(gradient, 1e-9))


def rod(points: Floats, start: Sequence[float], end: Sequence[float], radius0: float, radius1: float) -> Floats:
    """(n,) roughly the distance to a rod with round ends, from ``radius0`` at its start to ``radius1`` at its end."""
    axis = np.array(end) - np.array(start)
    offset = points - np.array(start)
    along = np.clip(offset @ axis / (axis @ axis), 0.0, 1.0)
    away = np.linalg.norm(offset - along[:, None] * axis, axis=1)
    return np.asarray(away - (radius0 + (radius1 - radius0) * along))


def joined(first: Floats, second: Floats, blend: float) -> Floats:
    """The union of two shapes; where they meet, clay of about the thickness ``blend`` fills the crease."""
    near = np.maximum(blend - np.abs(first - second), 0.0) / blend
    return np.minimum(first, second) - 0.25 * blend * near**2


def cut(first: Floats, second: Floats, blend: float) -> Floats:
    """The first shape without the second, with an edge rounded by about ``blend``."""
    return -joined(-first, second, blend)


def surface(field: Field, low: Sequence[float], high: Sequence[float], step: float) -> tuple[Floats, Ints]:
    """The surface of a shape inside a box: vertices (n, 3) and quads (m, 4) that face outwards.

    Each cell of a grid with spacing ``step`` that the surface crosses gets one vertex (Gibson, "Constrained elastic
    surface nets", 1998); then they are spread evenly and moved onto the surface.
    """
    counts = np.ceil((np.array(high) - np.array(low)) / step).astype(int) + 1
    axes = [start + step * np.arange(count) for start, count in zip(low, counts, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = np.concatenate([field(slab.reshape(-1, 3)) for slab in grid]).reshape(counts)

    inside = values < 0.0
    corners = [inside[tuple(slice(c, n - 1 + c) for c, n in zip(corner, counts, strict=True))]
               for corner in product((0, 1), repeat=3)]  # fmt: skip
    crossed = np.any(corners, axis=0) & ~np.all(corners, axis=0)
    number = np.full(crossed.shape, -1)
    number[crossed] = np.arange(crossed.sum())
    points = np.array(low) + step * (np.argwhere(crossed) + 0.5)

    quads = []
    for axis in range(3):
        before = np.take(inside, range(counts[axis] - 1), axis)
        after = np.take(inside, range(1, counts[axis]), axis)
        second, third = (axis + 1) % 3, (axis + 2) % 3
        for edges, order in ((before & ~after, (0, 1, 2, 3)), (~before & after, (3, 2, 1, 0))):
            cells = np.argwhere(edges)
            around = []
            for back2, back3 in ((1, 1), (0, 1), (0, 0), (1, 0)):
                cell = cells.copy()
                cell[:, second] -= back2
                cell[:, third] -= back3
                around.append(number[tuple(cell.T)])
            quads.append(np.stack([around[i] for i in order], axis=1))
    faces = np.concatenate(quads)
    return _spread(points, faces, field, step), faces


def _spread(points: Floats, faces: Ints, field: Field, step: float) -> Floats:
    """Vertices moved to the middle of their neighbors, then onto the surface, several times."""
    edges = np.concatenate([faces[:, [i, (i + 1) % 4]] for i in range(4)])
    count = np.bincount(edges[:, 0], minlength=len(points))[:, None]
    for _ in range(_ROUNDS):
        points = _onto(points, field, step)
        total = [np.bincount(edges[:, 0], points[edges[:, 1], axis], len(points)) for axis in range(3)]
        points = 0.5 * (points + np.stack(total, axis=1) / count)
    return _onto(_onto(points, field, step), field, step)


def _onto(points: Floats, field: Field, step: float) -> Floats:
    """Points moved along the gradient to where the field is zero, by at most half a step."""
    reach = 1e-4
    value = field(points)
    shifts = reach * np.eye(3)
    gradient = np.stack([field(points + shift) - field(points - shift) for shift in shifts], axis=1) / (2.0 * reach)
    length = np.maximum((gradient**2).sum(axis=1), 0.04)
    move = -np.clip(value / length, -0.5 * step, 0.5 * step)
    return points + move[:, None] * gradient
