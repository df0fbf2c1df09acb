# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons of triangles: covered alike however they were triangulated, and found where they are flat."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.triangles.geometry import areas
from qc3d_addon.solver.triangles.polygons import covering, flat_quads, labels_by_sides

from ..meshes import bent, box_surface, icosphere


def fan(loop: Ints, apex: int) -> Ints:
    turned = np.roll(loop, -apex)
    return np.stack([np.full(len(loop) - 2, turned[0]), turned[1:-1], turned[2:]], axis=1)


def counted(triangles: Ints, shares: Floats) -> dict[tuple[int, ...], float]:
    """What each triangle counts, begun at its smallest corner."""
    total: Counter[tuple[int, ...]] = Counter()
    for triangle, share in zip(triangles.tolist(), shares.tolist(), strict=True):
        start = triangle.index(min(triangle))
        total[tuple(triangle[start:] + triangle[:start])] += share
    return {triangle: round(share, 9) for triangle, share in total.items()}


class TestCovering:
    def test_both_diagonals_of_a_quad_count_half(self) -> None:
        triangles, shares = covering(np.array([[0, 1, 2], [0, 2, 3]]), np.array([7, 7]))
        half = {(0, 1, 2): 0.5, (0, 2, 3): 0.5, (0, 1, 3): 0.5, (1, 2, 3): 0.5}
        assert counted(triangles, shares) == half

    def test_triangles_stay(self) -> None:
        faces = np.array([[4, 2, 0], [1, 2, 3]])
        triangles, shares = covering(faces, np.array([3, 1]))
        assert np.array_equal(triangles, faces)
        assert np.array_equal(shares, np.ones(2))

    @given(st.integers(4, 40), st.integers(0, 39), st.integers(0, 39))
    def test_whatever_it_was_triangulated_along(self, corners: int, first: int, second: int) -> None:
        loop = np.random.default_rng(corners).permutation(100)[:corners]
        one, other = (covering(fan(loop, apex % corners), np.zeros(corners - 2, dtype=int)) for apex in (first, second))
        if corners <= 16:
            assert counted(*one) == counted(*other)
        assert one[1].sum() == pytest.approx(corners - 2)

    @given(st.integers(4, 30))
    def test_areas_of_flat_polygons_are_covered_once(self, corners: int) -> None:
        angle = np.arange(corners) * 2.0 * np.pi / corners
        points = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], axis=1)
        faces = fan(np.arange(corners), 1)
        triangles, shares = covering(faces, np.zeros(len(faces), dtype=int))
        assert float(shares @ areas(points, triangles)) == pytest.approx(float(areas(points, faces).sum()))

    def test_what_is_no_polygon_stays_as_it_is(self) -> None:
        apart = np.array([[0, 1, 2], [3, 4, 5]])
        ring = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]])  # has a hole
        turned = np.array([[0, 1, 2], [0, 3, 2]])  # against each other
        for faces in (apart, ring, turned):
            triangles, shares = covering(faces, np.zeros(len(faces), dtype=int))
            assert counted(triangles, shares) == counted(faces, np.ones(len(faces)))

    def test_many_polygons_at_once(self) -> None:
        corners = [[0, 1, 2, 3], [4, 5, 6, 7, 8], [9, 10, 11], [3, 2, 12, 13, 14, 15]]
        loops = [np.array(loop) for loop in corners]
        faces = np.concatenate([fan(loop, 0) for loop in loops])
        labels = np.repeat([5, 0, 9, 2], [len(loop) - 2 for loop in loops])
        together = counted(*covering(faces, labels))
        single: dict[tuple[int, ...], float] = {}
        for loop in loops:
            single |= counted(*covering(fan(loop, 0), np.zeros(len(loop) - 2, dtype=int)))
        assert together == single


class TestFlatQuads:
    def test_the_sides_of_a_box(self) -> None:
        points, faces = box_surface((1, 1, 1), (1.0, 2.0, 3.0))
        polygons = flat_quads([points, points * [1.5, 1.0, 0.5]], faces)
        assert (np.unique(polygons, return_counts=True)[1] == 2).all()

    def test_quads_of_a_flat_grid(self) -> None:
        points, faces = box_surface((4, 3, 5), (1.0, 2.0, 3.0))
        polygons = flat_quads([points], faces)
        found = {frozenset(faces[polygons == number].ravel().tolist()) for number in np.unique(polygons)}
        half = len(faces) // 2
        assert found == {frozenset((*faces[k].tolist(), *faces[k + half].tolist())) for k in range(half)}

    def test_not_where_a_key_bends_it(self) -> None:
        points, faces = box_surface((2, 2, 4), (1.0, 1.0, 4.0))
        curled = points.copy()
        curled[:, 2] += 0.1 * points[:, 0] * points[:, 1]
        assert len(np.unique(flat_quads([points, curled], faces))) > len(np.unique(flat_quads([points], faces)))
        # The sides that stay flat are still quads: those across the bend.
        assert len(np.unique(flat_quads([points, bent(points, 0.5)], faces))) < len(faces)

    def test_none_on_a_ball(self) -> None:
        points, faces = icosphere(2)
        assert np.array_equal(flat_quads([points], faces), np.arange(len(faces)))

    def test_three_triangles_at_an_edge_and_no_triangles(self) -> None:
        points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.2, 0.9, 0]])
        faces = np.array([[0, 1, 2], [0, 2, 3], [0, 2, 4]])
        assert np.array_equal(flat_quads([points], faces), np.arange(3))
        assert not len(flat_quads([points], np.empty((0, 3), dtype=np.int64)))


class TestLabelsBySides:
    @given(st.integers(0, 2**32 - 1))
    def test_in_any_order(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        loops = [[0, 1, 2, 3], [3, 2, 4, 5, 6, 7, 8, 9], [9, 8, 10], [10, 8, 7, 11, 12]]
        cut = [zigzag(np.array(loop)) if len(loop) > 5 else fan(np.array(loop), 1) for loop in loops]
        triangles = np.concatenate(cut)
        owner = np.repeat(np.arange(4), [len(loop) - 2 for loop in loops])
        order = random.permutation(len(triangles))
        polygons = np.array([loop + [-1] * (8 - len(loop)) for loop in loops])
        turned = triangles[:, ::-1] if seed % 2 else triangles
        assert np.array_equal(labels_by_sides(turned[order], polygons), owner[order])

    def test_part_of_none(self) -> None:
        polygons = np.array([[0, 1, 2, 3]])
        assert labels_by_sides(np.array([[4, 5, 6], [0, 1, 2]]), polygons).tolist() == [-1, 0]
        assert not len(labels_by_sides(np.empty((0, 3), dtype=np.int64), polygons))


def zigzag(loop: Ints) -> Ints:
    """Triangles of an octagon of which one has no side of it."""
    return loop[np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6], [6, 7, 0], [0, 2, 4], [4, 6, 0]])]


@pytest.mark.parametrize("size", [1e-310, 1e-200, 1e200, 1e307])
def test_sizes_near_the_ends_of_floating_point(size: float) -> None:
    square = size * np.array([[2.0, 2.0, 1.0], [3.0, 2.0, 1.0], [3.0, 3.0, 1.0], [2.0, 3.0, 1.0]])
    with np.errstate(all="raise", under="ignore"):
        found = flat_quads([square, square], np.array([[0, 1, 2], [0, 2, 3]]))
    assert len(found) == 2


def test_quads_are_the_same_however_the_keys_are_turned() -> None:
    """Diagonals of two keys count alike: both keys are measured by the same size, whatever their bounding boxes are."""
    points, faces = box_surface((3, 3, 12), (0.6, 0.6, 4.0))
    points = points - [0.3, 0.3, 2.0]
    weights = np.clip(points[:, 2:] / 0.4 + 0.5, 0.0, 1.0)
    bend = rotation_matrices(np.array([[0.0, np.pi / 2.0, 0.0]]))[0]
    folded = points + weights**2 * (3.0 - 2.0 * weights) * (points @ bend.T - points)
    expected = flat_quads([points, folded], faces)
    for seed in range(5):
        turn = rotation_matrices(np.random.default_rng(seed).normal(size=(1, 3)))[0]
        np.testing.assert_array_equal(flat_quads([points @ turn.T, folded @ turn.T], faces), expected)
