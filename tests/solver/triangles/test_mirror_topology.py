# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirror partners found by how a mesh is built."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.triangles.mirror_symmetry import known_partners, likely_partners
from qc3d_addon.solver.triangles.mirror_topology import topology_partners


def grid(columns: int, rows: int) -> tuple[Floats, Ints]:
    """A sheet of quads, symmetric across x = 0: its points and the corners of its quads (q, 4)."""
    across, along = np.meshgrid(np.linspace(-1.0, 1.0, 2 * columns + 1), np.linspace(0.0, 1.0, rows + 1), indexing="ij")
    points = np.stack([across, along, across**2], axis=2).reshape(-1, 3)
    number = np.arange(len(points)).reshape(2 * columns + 1, rows + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=2).reshape(-1, 4)
    return points, quads


def partners_of(points: Floats, polygons: list[list[int]], known: Ints) -> Ints:
    corners = np.concatenate([np.array(polygon) for polygon in polygons])
    return topology_partners(corners, np.cumsum([0, *map(len, polygons)]), known)


@given(st.integers(1, 6), st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_from_the_middle_outwards(columns: int, rows: int, seed: int) -> None:
    points, quads = grid(columns, rows)
    random = np.random.default_rng(seed)
    order = random.permutation(len(points))
    back = np.argsort(order)
    shuffled = back[quads][random.permutation(len(quads))]
    turned = [np.roll(quad, random.integers(4)).tolist() for quad in shuffled]
    places = points[order]
    middle = np.abs(places[:, 0]) < 1e-9
    known = np.where(middle, np.arange(len(points)), -1)
    bumpy = places + np.where(middle[:, None], 0.0, random.normal(scale=0.2, size=places.shape))
    assert (known_partners(bumpy, np.empty((0, 2), dtype=np.int64)) == known).mean() > 0.5
    found = partners_of(places, turned, known)
    np.testing.assert_allclose(places[found] * [-1.0, 1.0, 1.0], places, atol=1e-12)


@given(st.integers(2, 6), st.integers(2, 6), st.integers(0, 2**32 - 1))
def test_likely_ones_start_where_no_place_is_exact(columns: int, rows: int, seed: int) -> None:
    """Vertices that are off by a tenth of an edge find their partners, and one of them that is far off by topology."""
    points, quads = grid(columns, rows)
    random = np.random.default_rng(seed)
    shortest = min(1.0 / columns, 1.0 / rows)
    rough = points + random.uniform(-0.1, 0.1, points.shape) * shortest
    rough[random.integers(len(points))] += 0.6 * shortest
    sides = np.concatenate([quads[:, [corner, (corner + 1) % 4]] for corner in range(4)])
    edges = np.unique(np.sort(sides, axis=1), axis=0)
    nothing = np.full(len(points), -1)
    likely = likely_partners(rough, edges, nothing)
    right = np.array([int(np.abs(points - place * [-1.0, 1.0, 1.0]).sum(axis=1).argmin()) for place in points])
    sure = likely >= 0
    assert np.array_equal(likely[sure], right[sure])
    if sure[edges].all(axis=1).any():
        assert np.array_equal(partners_of(rough, quads.tolist(), likely), right)
    assert sure.any() or columns * rows < 9
    assert np.array_equal(likely_partners(points, edges, right), right)


def test_what_is_built_otherwise_has_none() -> None:
    points, quads = grid(2, 2)
    polygons = quads.tolist()
    far = max(range(len(polygons)), key=lambda number: points[polygons[number]][:, 0].mean())
    first, second, third, fourth = polygons.pop(far)
    polygons += [[first, second, third], [first, third, fourth]]
    known = np.where(np.abs(points[:, 0]) < 1e-9, np.arange(len(points)), -1)
    found = partners_of(points, polygons, known)
    assert 0 < (found < 0).sum() < len(points)
    sound = found >= 0
    assert np.array_equal(found[found[sound]], np.flatnonzero(sound))
    np.testing.assert_allclose(points[found[sound]] * [-1.0, 1.0, 1.0], points[sound], atol=1e-12)


def test_what_is_known_is_kept_and_nothing_is_made_up() -> None:
    points, quads = grid(1, 1)
    known = np.array([4, 5, 2, 3, 0, 1])
    assert np.array_equal(partners_of(points, quads.tolist(), known), known)
    nothing = np.full(6, -1)
    assert np.array_equal(partners_of(points, quads.tolist(), nothing), nothing)


@pytest.mark.parametrize("count", [1, 5])
def test_no_polygons(count: int) -> None:
    known = np.full(count, -1)
    empty = np.empty(0, dtype=np.int64)
    assert np.array_equal(topology_partners(empty, np.zeros(1, dtype=np.int64), known), known)
