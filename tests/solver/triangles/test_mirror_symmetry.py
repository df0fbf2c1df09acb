# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirror partners on symmetric shapes, closed lips, and shapes without symmetry."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.triangles.mirror_symmetry import mirror_partners

from ..meshes import icosphere

NO_EDGES = np.empty((0, 2), dtype=np.int64)


def edges_of(faces: Ints) -> Ints:
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(sides, axis=0)


@given(st.integers(1, 60), st.integers(0, 20), st.integers(0, 2), st.integers(0, 2**32 - 1))
def test_random_symmetric_points(pairs: int, middle: int, axis: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    right = random.uniform(0.1, 1.0, (pairs, 3))
    left = right.copy()
    left[:, axis] *= -1.0
    between = random.uniform(-1.0, 1.0, (middle, 3))
    between[:, axis] = 0.0
    order = random.permutation(2 * pairs + middle)
    points = np.concatenate([right, left, between])[order]
    partners = mirror_partners(points, NO_EDGES, axis, tolerance=1e-9)
    flipped = points[partners]
    flipped[:, axis] *= -1.0
    np.testing.assert_array_equal(flipped, points)
    np.testing.assert_array_equal(partners[partners], np.arange(len(points)))


def lips() -> tuple[Floats, Ints]:
    """An upper and a lower strip that touch along y = 0: vertices in one place, told apart by their edges alone."""
    x = np.linspace(-1.0, 1.0, 7)
    rows = [np.column_stack([x, np.full(7, y), np.zeros(7)]) for y in (1.0, 0.0, 0.0, -1.0)]
    numbers = np.arange(28).reshape(4, 7)
    along = [(row[i], row[i + 1]) for row in numbers for i in range(6)]
    across = [(numbers[a][i], numbers[b][i]) for a, b in ((0, 1), (2, 3)) for i in range(7)]
    return np.concatenate(rows), np.array(along + across)


def test_closed_lips_do_not_change_sides() -> None:
    points, edges = lips()
    partners = mirror_partners(points, edges)
    np.testing.assert_array_equal(partners.reshape(4, 7), np.arange(28).reshape(4, 7)[:, ::-1])


def test_lips_without_edges_cannot_be_told_apart() -> None:
    with pytest.raises(InputError, match="14 of 28 vertices have no mirror image"):
        mirror_partners(lips()[0], NO_EDGES)


def test_within_the_tolerance() -> None:
    points, faces = icosphere(2)
    points = points - 0.5
    noisy = points + np.random.default_rng(0).uniform(-1e-6, 1e-6, points.shape)
    np.testing.assert_array_equal(mirror_partners(noisy, edges_of(faces)), mirror_partners(points, edges_of(faces)))
    with pytest.raises(InputError, match="have no mirror image across x = 0"):
        mirror_partners(noisy, edges_of(faces), tolerance=1e-9)


def test_another_shape() -> None:
    points, faces = icosphere(1)
    points = points - 0.5
    points[points[:, 0] > 0.1] *= 1.1
    with pytest.raises(InputError, match=r"\d+ of 42 vertices have no mirror image across x = 0; the shape must"):
        mirror_partners(points, edges_of(faces))
