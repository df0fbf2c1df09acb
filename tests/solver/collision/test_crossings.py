# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossing pairs of triangles against exact arithmetic on all pairs, including touching and coplanar ones."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision import box_tree
from qc3d_addon.solver.collision.box_tree import CrowdedError
from qc3d_addon.solver.collision.crossings import CrossingSearch, crossing_pairs
from qc3d_addon.solver.collision.self_crossings import CrossingLimit
from qc3d_addon.solver.numerics.rotations import rotation_matrices

from ..meshes import icosphere

Point = tuple[Fraction, ...]


def minus(first: Point, second: Point) -> Point:
    return tuple(a - b for a, b in zip(first, second, strict=True))


def dot(first: Point, second: Point) -> Fraction:
    return sum((a * b for a, b in zip(first, second, strict=True)), Fraction(0))


def cross(first: Point, second: Point) -> Point:
    (a, b, c), (u, v, w) = first, second
    return (b * w - c * v, c * u - a * w, a * v - b * u)


def goes_through(tail: Point, head: Point, triangle: list[Point]) -> bool:
    """Whether the open segment meets the open triangle in one point: the point itself and its barycentric weights."""
    normal = cross(minus(triangle[1], triangle[0]), minus(triangle[2], triangle[0]))
    heights = dot(normal, minus(tail, triangle[0])), dot(normal, minus(head, triangle[0]))
    if heights[0] * heights[1] >= 0:
        return False
    part = heights[0] / (heights[0] - heights[1])
    point = tuple(a + part * (b - a) for a, b in zip(tail, head, strict=True))
    shares = []
    for corner in range(3):
        start, end = triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]
        shares.append(dot(normal, cross(minus(end, start), minus(point, start))) / dot(normal, normal))
    assert sum(shares) == 1
    return min(shares) > 0


def tried_one_by_one(points: Floats, faces: Ints) -> list[list[int]]:
    exact = [tuple(Fraction(value) for value in point) for point in points.tolist()]
    corners = [[exact[vertex] for vertex in face] for face in faces.tolist()]
    found = []
    _, listed = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)  # one that comes again counts once
    for (first, one), (second, other) in combinations([(row, corners[row]) for row in sorted(listed.tolist())], 2):
        if set(faces[first].tolist()) & set(faces[second].tolist()):
            continue
        if any(
            goes_through(side[start], side[start - 1], triangle)
            for triangle, side in ((one, other), (other, one))
            for start in range(3)
        ):
            found.append([first, second])
    return found


def assert_as_tried(points: Floats, faces: Ints) -> Ints:
    found = crossing_pairs(points, faces)
    assert found.shape[1:] == (2,)
    assert found.dtype == np.int64
    assert found.tolist() == tried_one_by_one(points, faces)
    return found


def triangles(count: int) -> Ints:
    """Triangles that share no vertex."""
    return np.arange(3 * count).reshape(-1, 3)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_random_soups(seed: int) -> None:
    random = np.random.default_rng(seed)
    assert_as_tried(random.normal(size=(36, 3)), triangles(12))


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_touching_and_coplanar_triangles(seed: int) -> None:
    # Few whole numbers: vertices on faces, edges on edges, equal and degenerate triangles are all there.
    random = np.random.default_rng(seed)
    assert_as_tried(random.integers(-1, 2, size=(36, 3)).astype(float), triangles(12))


@settings(max_examples=15)
@given(st.integers(0, 2**32 - 1))
def test_meshes_with_shared_vertices(seed: int) -> None:
    random = np.random.default_rng(seed)
    assert_as_tried(random.normal(size=(8, 3)), random.integers(0, 8, size=(14, 3)))


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_triangles_of_very_different_sizes(seed: int) -> None:
    random = np.random.default_rng(seed)
    sizes = 10.0 ** random.uniform(-3.0, 1.0, size=(14, 1, 1))
    corners = sizes * random.normal(size=(14, 3, 3)) + 0.1 * random.normal(size=(14, 1, 3))
    assert_as_tried(corners.reshape(-1, 3), triangles(14))


def test_small_chunks_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.random.default_rng(5).normal(size=(60, 3))
    expected = crossing_pairs(points, triangles(20))
    assert len(expected) > 10
    for chunk in (1, 7, 50):
        monkeypatch.setattr(box_tree, "_CHUNK", chunk)
        np.testing.assert_array_equal(crossing_pairs(points, triangles(20)), expected)


FLAT = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])


@pytest.mark.parametrize(
    ("other", "crosses"),
    [
        ([[1, 1, -1], [1, 1, 1], [5, 5, 1]], True),
        ([[1, 1, 0], [1, 1, 1], [2, 1, 1]], False),  # a vertex in the face
        ([[0, 0, 0], [-1, 0, 1], [-1, 0, -1]], False),  # a vertex on a vertex
        ([[2, -1, 0], [2, 1, 1], [2, 1, -1]], True),
        ([[2, 0, 1], [2, 0, -1], [2, -3, 0]], False),  # an edge through an edge, the rest outside
        ([[1, 1, 0], [2, 1, 0], [1, 2, 0]], False),  # coplanar, one inside the other
        ([[-1, -1, 0], [3, 1, 0], [1, 3, 0]], False),  # coplanar, overlapping
        ([[0, 0, 0], [4, 0, 0], [0, 4, 0]], False),  # the same again
        ([[1, 1, -1], [1, 1, 1], [1, 1, 0]], True),  # a line is an edge that goes through
        ([[1, 1, 0], [1, 1, 0], [1, 1, 0]], False),  # a point
        ([[9, 9, -1], [9, 9, 1], [9, 8, 0]], False),
    ],
)
def test_two_triangles(other: list[list[float]], crosses: bool) -> None:
    points = np.concatenate([FLAT, np.array(other, dtype=float)])
    assert len(assert_as_tried(points, triangles(2))) == crosses
    assert len(crossing_pairs(points, np.array([[3, 5, 4], [2, 1, 0]]))) == crosses


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_triangles_of_a_plane_do_not_cross_however_it_is_turned(seed: int) -> None:
    # Rounding alone decides on which side of each other's planes their corners are.
    random = np.random.default_rng(seed)
    flat = np.column_stack([random.uniform(size=(300, 2)), np.zeros(300)])
    turned = flat @ rotation_matrices(random.normal(size=(1, 3)))[0].T + random.normal(size=3)
    assert not len(crossing_pairs(turned, triangles(100)))
    assert not len(crossing_pairs(turned + 1e-13 * random.normal(size=turned.shape), triangles(100)))


def test_meshes_that_do_not_cross() -> None:
    points, faces = icosphere(2)
    assert not len(crossing_pairs(points, faces))
    nested = np.concatenate([points, 0.5 + 0.5 * (points - 0.5)])
    assert not len(crossing_pairs(nested, np.concatenate([faces, faces + len(points)])))


def test_a_closed_surface_in_two_halves_touches_along_its_seam() -> None:
    points, faces = icosphere(2)
    seam = np.where((points[faces].mean(axis=1)[:, :1] < 0.5), faces, faces + len(points))
    assert not len(crossing_pairs(np.concatenate([points, points]), seam))


def test_two_spheres_cross_in_a_band() -> None:
    points, faces = icosphere(2)
    both, all_faces = np.concatenate([points, points + [0.3, 0.01, 0.02]]), np.concatenate([faces, faces + len(points)])
    found = crossing_pairs(both, all_faces)
    assert len(found) > 20
    assert (found[:, 0] < len(faces)).all()
    assert (found[:, 1] >= len(faces)).all()
    assert np.abs(both[all_faces[found]].mean(axis=2)[:, :, 0] - 0.65).max() < 0.1


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_triangles(count: int) -> None:
    assert crossing_pairs(FLAT, triangles(count)).shape == (0, 2)


def test_triangles_without_any_size() -> None:
    points = np.random.default_rng(0).normal(size=(50, 3))
    assert not len(crossing_pairs(points, np.repeat(np.arange(50), 3).reshape(-1, 3)))
    assert not len(crossing_pairs(np.zeros((6, 3)), triangles(2)))


def test_a_triangle_that_is_listed_again_counts_once() -> None:
    points, faces = np.concatenate([FLAT, [[1, 1, -1], [1, 1, 1], [5, 5, 1]]]), triangles(2)
    again = np.concatenate([faces, np.repeat(np.roll(faces[:1], 1, axis=1), 20_000, axis=0), faces[::-1]])
    assert crossing_pairs(points, again).tolist() == [[0, 1]]
    moving = np.zeros(len(again), dtype=bool)
    assert not len(crossing_pairs(points, again, moving))
    moving[0] = True
    assert crossing_pairs(points, again, moving).tolist() == [[0, 1]]


def test_the_triangles_of_a_part_that_is_a_point_cross_nothing() -> None:
    points, faces = icosphere(3)
    together = np.concatenate([points, np.tile(points.mean(axis=0), (len(points), 1))])
    search = CrossingSearch(np.concatenate([faces, faces + len(points)]), [together])
    assert not len(search.pairs(together))


def test_a_search_that_would_take_too_long_is_given_up() -> None:
    points, faces = icosphere(2)
    copies = 12_000
    jitter = 1e-3 * np.random.default_rng(2).normal(size=(3 * copies, 3))
    crowded = np.concatenate([points, np.tile(points[faces[0]], (copies, 1)) + jitter])
    together = np.concatenate([faces, len(points) + triangles(copies)])
    with pytest.raises(CrowdedError, match="searching for crossings would take too long"):
        crossing_pairs(crowded, together)
    limit = CrossingLimit(together, crowded, 1.1 * crowded, np.zeros(len(crowded), dtype=bool))
    assert limit.excess(crowded) is None
    assert not limit.new_vertices(crowded).any()


def test_one_huge_triangle_over_thousands_of_tiny_ones() -> None:
    # The search grid must not be as fine as the tiny ones under the huge one, nor as coarse as the huge one.
    random = np.random.default_rng(1)
    tiny = random.uniform(0.4, 0.6, size=(20_000, 1, 3)) + 1e-5 * random.normal(size=(20_000, 3, 3))
    huge = np.array([[[-90.0, -80, -70], [95, 85, -75], [10, 20, 110]]])
    corners = np.concatenate([tiny, huge])
    heights = (tiny - huge[0, 0]) @ np.cross(huge[0, 1] - huge[0, 0], huge[0, 2] - huge[0, 0])
    through = np.flatnonzero((heights.min(axis=1) < 0.0) & (heights.max(axis=1) > 0.0))
    found = crossing_pairs(corners.reshape(-1, 3), triangles(len(corners)))
    np.testing.assert_array_equal(found[found[:, 1] == 20_000, 0], through)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_of_moving_triangles_alone(seed: int, part: float) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(60, 3)) * random.choice([0.05, 1.0], size=(60, 1))
    faces = random.permuted(np.tile(np.arange(60), (25, 1)), axis=1)[:, :3]
    moving = random.random(25) < part
    everything = crossing_pairs(points, faces)
    np.testing.assert_array_equal(crossing_pairs(points, faces, moving), everything[moving[everything].any(axis=1)])
