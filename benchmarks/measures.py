# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of what an animator sees in a sequence of shapes, independent of how the frames were made.

Measures of one frame at time t (0 is perfect)
    edge_excess_p99, edge_excess_mean
        How far an edge's length leaves the interval between its two key lengths, relative to the nearer end of
        that interval: 99th percentile and mean over the edges.
    area_excess_mean
        The same for triangle areas, mean over the triangles.
    volume_dev
        Relative difference between the volume of the closed components and the straight blend of the keys' volumes;
        None if no component is closed.
    intersections
        Crossing pairs of triangles without a common vertex, beyond the larger count of the two keys; None without
        Blender's BVH tree.
    still_drift
        Largest distance of a still vertex from its place, relative to the bounding-box diagonal; None if there is none.
    arc
        Mean distance from the straight path relative to the mean distance traveled; for information only.
Measures of a sequence
    key_error
        Largest coordinate difference between the first and last frame and the keys, relative to the diagonal.
    jerk
        Largest second difference of a vertex relative to the largest single step; a jump shows here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STILL = 1e-6  # of the diagonal: vertices that move less between the keys count as still
WORST = (
    "edge_excess_p99", "edge_excess_mean", "area_excess_mean", "volume_dev", "intersections", "still_drift", "arc",
)  # fmt: skip


def diagonal(positions: Floats) -> float:
    """Length of the bounding-box diagonal."""
    return float(np.linalg.norm(np.ptp(positions, axis=0)))


def edge_uses(faces: Ints) -> tuple[Ints, Ints]:
    """The distinct edges (e, 2) of the triangles, and how many triangles use each edge."""
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(sides, axis=0, return_counts=True)
    return edges, uses


def edge_lengths(positions: Floats, edges: Ints) -> Floats:
    """Lengths (e,) of the edges."""
    return np.asarray(np.linalg.norm(positions[edges[:, 1]] - positions[edges[:, 0]], axis=1))


def triangle_areas(positions: Floats, faces: Ints) -> Floats:
    """Areas (m,) of the triangles."""
    a, b, c = positions[faces.T]
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def enclosed_volume(positions: Floats, faces: Ints) -> float:
    """Signed volume enclosed by closed triangles (divergence theorem)."""
    a, b, c = positions[faces.T]
    return float((a * np.cross(b, c)).sum() / 6.0)


def closed_triangles(faces: Ints) -> NDArray[np.bool_]:
    """(m,) whether each triangle belongs to a component that has exactly two triangles at every edge."""
    edges, uses = edge_uses(faces)
    size = int(faces.max()) + 1
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(size, size))
    count, component = connected_components(graph, directed=False)
    closed = np.ones(count, dtype=bool)
    closed[component[edges[uses != 2, 0]]] = False
    return np.asarray(closed[component[faces[:, 0]]])


def excess(values: Floats, first: Floats, second: Floats, floor: float) -> Floats:
    """Relative distance of each value from the interval between its two key values.

    ``floor`` bounds the divisor from below, so that a vanishing edge or triangle does not count as infinite.
    """
    low, high = np.minimum(first, second), np.maximum(first, second)
    below = (low - values) / np.maximum(low, floor)
    above = (values - high) / np.maximum(high, floor)
    return np.asarray(np.maximum(np.maximum(below, above), 0.0))


def count_crossings(positions: Floats, faces: Ints) -> int | None:
    """Number of crossing pairs of triangles that share no vertex; None where Blender's module is missing."""
    try:
        import bpy  # noqa: F401  (mathutils comes with it)
        from mathutils.bvhtree import BVHTree
    except ImportError:
        return None
    tree_of: Callable[..., Any] = BVHTree.FromPolygons  # some stubs say that it returns nothing
    tree = tree_of(positions.tolist(), faces.tolist(), all_triangles=True, epsilon=0.0)
    pairs = np.array(tree.overlap(tree), dtype=np.int64).reshape(-1, 2)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    first, second = faces[pairs[:, 0]], faces[pairs[:, 1]]
    touching = (first[:, :, None] == second[:, None, :]).any(axis=(1, 2))
    return int(len(pairs) - touching.sum())


class Judge:
    """Measures frames of one pair of keys; everything that depends on the keys alone is computed once."""

    def __init__(self, faces: ArrayLike, key0: ArrayLike, key1: ArrayLike, *, crossings: bool = True) -> None:
        self.faces = np.asarray(faces, dtype=np.int64)
        self.key0, self.key1 = np.asarray(key0, dtype=np.float64), np.asarray(key1, dtype=np.float64)
        self.diagonal = diagonal(self.key0)
        self.edges = edge_uses(self.faces)[0]
        self.key_lengths = tuple(edge_lengths(key, self.edges) for key in (self.key0, self.key1))
        self.key_areas = tuple(triangle_areas(key, self.faces) for key in (self.key0, self.key1))
        self.closed = self.faces[closed_triangles(self.faces)]
        self.key_volumes = tuple(enclosed_volume(key, self.closed) for key in (self.key0, self.key1))
        travel = np.linalg.norm(self.key1 - self.key0, axis=1)
        self.total_travel = float(travel.sum())
        self.still = travel <= STILL * self.diagonal
        self.crossings = crossings
        counts = [count_crossings(key, self.faces) for key in (self.key0, self.key1)] if crossings else []
        self.key_crossings = max((count for count in counts if count is not None), default=0)

    def frame(self, positions: ArrayLike, time: float) -> dict[str, Any]:
        """Measures of one frame, JSON-able."""
        shape = np.asarray(positions, dtype=np.float64)
        (length0, length1), (area0, area1), (volume0, volume1) = self.key_lengths, self.key_areas, self.key_volumes
        edge = excess(edge_lengths(shape, self.edges), length0, length1, 1e-3 * float(np.median(length0)))
        area = excess(triangle_areas(shape, self.faces), area0, area1, 1e-3 * float(np.median(area0)))
        volume = (1.0 - time) * volume0 + time * volume1
        crossings = count_crossings(shape, self.faces) if self.crossings else None
        straight = (1.0 - time) * self.key0 + time * self.key1
        drift = np.linalg.norm(shape[self.still] - self.key0[self.still], axis=1)
        return {
            "t": float(time),
            "finite": bool(np.isfinite(shape).all()),
            "edge_excess_p99": float(np.percentile(edge, 99)),
            "edge_excess_mean": float(edge.mean()),
            "area_excess_mean": float(area.mean()),
            "volume_dev": abs(enclosed_volume(shape, self.closed) - volume) / abs(volume) if len(self.closed) else None,
            "intersections": None if crossings is None else max(0, crossings - self.key_crossings),
            "still_drift": float(drift.max()) / self.diagonal if len(drift) else None,
            "arc": float(np.linalg.norm(shape - straight, axis=1).sum()) / max(self.total_travel, 1e-30),
        }

    def sequence(self, frames: ArrayLike, times: ArrayLike) -> dict[str, Any]:
        """Measures of a sequence whose first and last frame stand for the keys, JSON-able."""
        shapes, moments = np.asarray(frames, dtype=np.float64), np.asarray(times, dtype=np.float64)
        rows = [self.frame(shape, float(time)) for time, shape in zip(moments, shapes, strict=True)]
        inner = [row for row in rows if 0.0 < row["t"] < 1.0] or rows
        worst = {
            name: None if any(row[name] is None for row in inner) else max(row[name] for row in inner) for name in WORST
        }
        misses = [np.abs(shapes[0] - self.key0).max(), np.abs(shapes[-1] - self.key1).max()]
        return {
            "vertices": len(self.key0),
            "triangles": len(self.faces),
            "frames": len(shapes),
            "key_error": float(max(misses)) / self.diagonal,
            "jerk": jerk(shapes),
            "worst": worst,
            "rows": rows,
        }


def jerk(frames: Floats) -> float:
    """Largest second difference of a vertex relative to the largest single step; 0 for fewer than three frames."""
    if len(frames) < 3:
        return 0.0
    steps = np.diff(frames, axis=0)
    bends = np.diff(steps, axis=0)
    return float(np.linalg.norm(bends, axis=2).max() / max(np.linalg.norm(steps, axis=2).max(), 1e-30))


def measure(faces: ArrayLike, frames: ArrayLike, times: ArrayLike, key0: ArrayLike, key1: ArrayLike) -> dict[str, Any]:
    """Measures of a sequence, in one call; see the module's docstring."""
    return Judge(faces, key0, key1).sequence(frames, times)
