# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Signed distances from meshes for which they are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.collision.surface_distance import SurfaceDistance

from ..meshes import box_surface, icosphere


def box_distance(points: Floats) -> Floats:
    """From the box of half sizes 1, 1, 2 in the middle."""
    beyond = np.abs(points) - np.array([1.0, 1.0, 2.0])
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0))


@pytest.mark.parametrize("cells", [(1, 1, 1), (3, 2, 5)])
def test_a_box(cells: tuple[int, int, int]) -> None:
    points, faces = box_surface(cells, (2.0, 2.0, 4.0))
    points = points - [0.0, 0.0, 2.0]
    queries = np.random.default_rng(0).uniform(-3.0, 3.0, (500, 3))
    distance, place, normal = SurfaceDistance(points, faces).nearest(queries)
    np.testing.assert_allclose(distance, box_distance(queries), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(queries - place, axis=1), np.abs(distance), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-12)


@given(st.integers(0, 2**32 - 1))
def test_no_triangle_is_nearer(seed: int) -> None:
    random = np.random.default_rng(seed)
    points, faces = icosphere(1)
    points = points * random.uniform(0.3, 2.0, 3) + random.normal(scale=0.02, size=points.shape)
    queries = random.uniform(-0.5, 2.0, (40, 3))
    distance, place, _ = SurfaceDistance(points, faces).nearest(queries)
    weights = random.dirichlet(np.ones(3), size=(len(faces), 60))
    on_surface = np.einsum("fsc,fci->fsi", weights, points[faces]).reshape(-1, 3)
    nearest = np.linalg.norm(queries[:, None] - on_surface, axis=2).min(axis=1)
    assert (np.abs(distance) <= nearest + 1e-12).all()
    np.testing.assert_allclose(np.linalg.norm(queries - place, axis=1), np.abs(distance), atol=1e-12)


def test_one_huge_triangle_among_many_small_ones() -> None:
    points, faces = icosphere(3)
    floor = np.array([[-50.0, -50.0, -1.0], [50.0, -50.0, -1.0], [0.0, 80.0, -1.0]])
    found = SurfaceDistance(np.concatenate([points, floor]), np.concatenate([faces, [[642, 643, 644]]]))
    distance, _, normal = found.nearest(np.array([[20.0, 3.0, -0.5], [-10.0, 5.0, 1.0]]))
    np.testing.assert_allclose(distance, [0.5, 2.0], atol=1e-12)
    np.testing.assert_allclose(normal, [[0.0, 0.0, 1.0]] * 2, atol=1e-12)


def test_triangles_without_an_area_are_left_out() -> None:
    points, faces = icosphere(1)
    with_flat = np.concatenate([faces, [[0, 0, 1], [2, 2, 2]]])
    queries = np.random.default_rng(0).uniform(size=(20, 3))
    expected = SurfaceDistance(points, faces).nearest(queries)
    for one, other in zip(expected, SurfaceDistance(points, with_flat).nearest(queries), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_large_coarse_floor_beside_a_fine_ball() -> None:
    ball, ball_faces = icosphere(4, radius=1.0)
    ball = ball - 0.5
    floor, floor_faces = box_surface((1, 1, 1), (100.0, 100.0, 1.0))
    floor = floor - [50.0, 50.0, 2.2]
    found = SurfaceDistance(np.concatenate([ball, floor]), np.concatenate([ball_faces, floor_faces + len(ball)]))
    random = np.random.default_rng(0)
    directions = random.normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for radius, side in ((0.98, -1.0), (1.02, 1.0)):
        distance, _, _ = found.nearest(radius * directions)
        assert (np.sign(distance) == side).all()
        np.testing.assert_allclose(distance, radius - 1.0, atol=2e-3)


def test_copies_of_vertices_are_one_vertex() -> None:
    points, faces = box_surface((1, 1, 1), (2.0, 2.0, 2.0))
    split = points[faces].reshape(-1, 3)
    queries = np.random.default_rng(1).uniform(-1.0, 3.0, (400, 3))
    joined = SurfaceDistance(points, faces).nearest(queries)[0]
    apart = SurfaceDistance(split, np.arange(len(split)).reshape(-1, 3)).nearest(queries)[0]
    np.testing.assert_allclose(apart, joined, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("sharpness", [0.02, 0.3])
def test_the_side_is_right_beyond_sharp_edges(sharpness: float) -> None:
    # A wedge: beyond its edge, the normal of one of the two faces alone says inside.
    above, below = [[1.0, 0.0, sharpness], [1.0, 1.0, sharpness]], [[1.0, 0.0, -sharpness], [1.0, 1.0, -sharpness]]
    points = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], *above, *below])
    faces = np.array([[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4], [2, 4, 5], [2, 5, 3], [0, 4, 2], [1, 3, 5]])
    random = np.random.default_rng(2)
    beyond = np.column_stack([-random.uniform(0.01, 1.0, 200), random.uniform(0, 1, 200), random.normal(size=200)])
    assert (SurfaceDistance(points, faces).nearest(beyond)[0] > 0.0).all()


@pytest.mark.parametrize("far", [1e6, 1e20, 1e200])
def test_from_very_far_away(far: float) -> None:
    ball, faces = icosphere(3)
    directions = np.random.default_rng(3).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with np.errstate(all="ignore"):
        distance, _, _ = SurfaceDistance(ball, faces).nearest(far * directions)
    assert distance.shape == (200,)
    if far < 1e100:  # beyond that, its square is not a number
        np.testing.assert_allclose(np.abs(distance), far, rtol=1e-5)
    if far < 1e10:  # beyond that, the ball is a point to double precision, which has no side
        assert (distance > 0.0).all()
