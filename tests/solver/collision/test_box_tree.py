# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Overlapping boxes against a comparison of all pairs, on meshes, triangle soups and fans of any size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Bools, Floats, Ints
from qc3d_addon.solver.collision import box_tree
from qc3d_addon.solver.collision.box_tree import Budget, CrowdedError, TriangleTree

from ..meshes import icosphere


def found(tree: TriangleTree, points: Floats, faces: Ints) -> list[tuple[int, int]]:
    corners = points.T[:, faces[tree.order]]
    chunks = list(tree.meeting(corners.min(axis=2), corners.max(axis=2), Budget(len(faces))))
    pairs = [np.sort(tree.order[np.stack(chunk)], axis=0) for chunk in chunks]
    return sorted(map(tuple, np.concatenate(pairs, axis=1).T.tolist()))


def compared(points: Floats, faces: Ints, moving: Bools) -> set[tuple[int, int]]:
    """Every pair whose boxes meet, one of them moving."""
    low, high = points[faces].min(axis=1), points[faces].max(axis=1)
    meet = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    meet &= moving[:, None] | moving[None]
    return set(map(tuple, np.argwhere(np.triu(meet, 1)).tolist()))


def without_neighbors(pairs: set[tuple[int, int]], faces: Ints) -> set[tuple[int, int]]:
    corners = [set(face) for face in faces.tolist()]
    return {(one, other) for one, other in pairs if not corners[one] & corners[other]}


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 70), st.integers(4, 60))
def test_random_meshes_in_shapes_far_from_those_the_tree_was_built_for(seed: int, count: int, vertices: int) -> None:
    random = np.random.default_rng(seed)
    faces = np.array([random.permutation(vertices)[:3] for _ in range(count)])
    shapes = random.normal(size=(3, vertices, 3))
    moving = random.random(count) < random.random()
    tree = TriangleTree(faces, shapes[:2], moving)
    np.testing.assert_array_equal(np.sort(tree.order), np.arange(count))
    for points in shapes:
        assert found(tree, points, faces) == sorted(without_neighbors(compared(points, faces, moving), faces))


@pytest.mark.slow
def test_a_sphere_that_is_crumpled() -> None:
    points, faces = icosphere(3)
    crumpled = points * np.random.default_rng(3).uniform(0.2, 1.0, (len(points), 1))
    moving = points[faces].mean(axis=1)[:, 2] > 0.3
    tree = TriangleTree(faces, [points], moving)
    for shape in (points, crumpled):
        assert found(tree, shape, faces) == sorted(without_neighbors(compared(shape, faces, moving), faces))


def test_no_two_triangles_of_a_fan_too_large_to_list_are_compared() -> None:
    count = box_tree._MOST_AROUND_A_VERTEX + 9
    angles = 2.0 * np.pi * np.arange(count) / count
    points = np.concatenate([np.zeros((1, 3)), np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)])
    rim = np.arange(count)
    faces = np.stack([np.zeros(count, dtype=np.int64), 1 + rim, 1 + (rim + 1) % count], axis=1)
    points = np.concatenate([points, icosphere(1)[0] - 0.5])
    ball = icosphere(1)[1] + 1 + count
    both, all_move = np.concatenate([faces, ball]), np.ones(count + len(ball), dtype=bool)
    pairs = found(TriangleTree(both, [points], all_move), points, both)
    expected = without_neighbors(compared(points, both, all_move), both)
    # All share the hub: only pairs of the ball, and of the ball and the fan, are left.
    assert pairs == sorted(expected)
    assert any(one < count <= other for one, other in pairs)


@given(st.integers(0, 2**32 - 1), st.integers(2, 70), st.integers(1, 5))
def test_pairs_of_one_group_are_left_out(seed: int, count: int, groups: int) -> None:
    random = np.random.default_rng(seed)
    points, faces = random.normal(size=(3 * count, 3)), np.arange(3 * count).reshape(-1, 3)
    moving, labels = random.random(count) < 0.8, random.integers(-1, groups, size=count)
    everything = compared(points, faces, moving)
    expected = sorted((a, b) for a, b in everything if labels[a] != labels[b] or labels[a] < 0)
    assert found(TriangleTree(faces, [points], moving, labels), points, faces) == expected


class TestWork:
    """Counted, not timed: ordinary meshes stay far below what is too much, whatever the triangles are like."""

    @staticmethod
    def spent(points: Floats, faces: Ints) -> float:
        budget = Budget(len(faces))
        before = budget.left
        corners = points.T[:, faces[(tree := TriangleTree(faces, [points], np.ones(len(faces), dtype=bool))).order]]
        for _ in tree.meeting(corners.min(axis=2), corners.max(axis=2), budget):
            pass
        return (before - budget.left) / len(faces)

    def test_an_ordinary_mesh(self) -> None:
        assert self.spent(*icosphere(4)) < 20.0

    def test_a_vertex_of_ten_thousand_triangles(self) -> None:
        count = 10_000
        angles = 2.0 * np.pi * np.arange(count) / count
        rim = np.arange(count)
        points = np.concatenate([[[0.1, 0.2, 1.5]], np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)])
        assert self.spent(points, np.stack([0 * rim, 1 + rim, 1 + (rim + 1) % count], axis=1)) < 20.0

    def test_more_than_allowed_is_given_up(self) -> None:
        count = 300
        points = np.random.default_rng(0).normal(size=(3 * count, 3))
        faces = np.arange(3 * count).reshape(-1, 3)
        tree = TriangleTree(faces, [points], np.ones(count, dtype=bool))
        corners = points.T[:, faces]
        budget = Budget(count)
        budget.left = 1000
        with pytest.raises(CrowdedError, match=r"triangles overlap .* remove repeated triangles"):
            list(tree.meeting(corners.min(axis=2), corners.max(axis=2), budget))


@pytest.mark.parametrize("chunk", [1, 5, 40])
def test_chunks_give_the_same(chunk: int, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(8)
    points, faces = random.normal(size=(40, 3)), random.integers(0, 40, size=(60, 3))
    tree = TriangleTree(faces, [points], np.ones(60, dtype=bool))
    expected = found(tree, points, faces)
    assert len(expected) > 50
    monkeypatch.setattr(box_tree, "_CHUNK", chunk)
    assert found(tree, points, faces) == expected


def test_only_a_small_part_of_a_fine_mesh_is_compared() -> None:
    points, faces = icosphere(4)
    tree = TriangleTree(faces, [points], np.ones(len(faces), dtype=bool))
    assert sum(len(first) for first, _ in tree._apart) < 15 * len(faces)
