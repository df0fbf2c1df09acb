# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A search that is made once for all triangles finds the same as one for the moving ones, and as one in tight boxes."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.collision.crossings import CrossingSearch
from qc3d_addon.solver.collision.self_crossings import CrossingLimit

from ..meshes import icosphere


def crumpled(points: np.ndarray, random: np.random.Generator, by: float) -> np.ndarray:
    return points + random.normal(scale=by, size=points.shape)


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(5)


@pytest.mark.parametrize("is_repeated", [False, True])
def test_fewer_triangles(random: np.random.Generator, is_repeated: bool) -> None:
    points, faces = icosphere(3)
    if is_repeated:
        faces = np.concatenate([faces, faces[40:60]])
    shape = crumpled(points, random, 0.08)
    moving = points[faces].mean(axis=1)[:, 2] > 0.4
    whole = CrossingSearch(faces, [points])
    expected = CrossingSearch(faces, [points], moving).pairs(shape)
    np.testing.assert_array_equal(whole.among(moving).pairs(shape), expected)
    assert 0 < len(expected) < len(whole.pairs(shape))
    assert not len(whole.among(np.zeros(len(faces), dtype=bool)).pairs(shape))
    # What was derived leaves the search as it was.
    np.testing.assert_array_equal(whole.pairs(shape), CrossingSearch(faces, [points]).pairs(shape))


def test_shapes_in_boxes_around_their_points(random: np.random.Generator) -> None:
    points, faces = icosphere(3)
    shapes = [crumpled(points, random, 0.06) for _ in range(5)]
    search = CrossingSearch(faces, [points])
    within = search.within(np.min(shapes, axis=0), np.max(shapes, axis=0))
    for shape in shapes:
        found = within.pairs(shape)
        assert len(found)
        np.testing.assert_array_equal(found, search.pairs(shape))


def test_a_limit_counts_the_same_with_a_search_that_is_there(random: np.random.Generator) -> None:
    points, faces = icosphere(3)
    key1 = points + 0.2 * np.maximum(points[:, 2:], 0.0) * [1.0, 0.0, 0.0]
    still = (points == key1).all(axis=1)
    alone = CrossingLimit(faces, points, key1, still)
    shared = CrossingLimit(faces, points, key1, still, CrossingSearch(faces, [points]))
    other = CrossingLimit(faces, points, key1, still, CrossingSearch(faces[:-1], [points]))
    straight = 0.5 * (points + key1)
    # Between the keys, and far from both.
    for by, crosses in ((0.0, False), (0.08, True)):
        shape = np.where(still[:, None], points, crumpled(straight, random, by))
        expected = len(CrossingSearch(faces, [points], ~still[faces].all(axis=1)).pairs(shape))
        assert bool(expected) == crosses
        assert alone.excess(shape) == shared.excess(shape) == other.excess(shape) == expected
        np.testing.assert_array_equal(alone.new_pairs(shape), shared.new_pairs(shape))
