# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Elimination orders: complete, and with sparse factors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array, diags_array, eye_array, kron

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.numerics.nested_dissection import elimination_order, factored


def grid(side: int) -> tuple[Floats, csr_array]:
    """Points of a square grid and a positive definite matrix that ties neighbors."""
    line = diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(side, side))
    matrix = kron(line, eye_array(side)) + kron(eye_array(side), line) + 1e-3 * eye_array(side * side)
    ticks = np.arange(side, dtype=np.float64)
    return np.stack(np.meshgrid(ticks, ticks, [0.0], indexing="ij"), axis=-1).reshape(-1, 3), csr_array(matrix)


@given(st.integers(0, 2**32 - 1), st.integers(0, 300), st.booleans())
def test_every_unknown_comes_once_wherever_it_is(seed: int, count: int, same_place: bool) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(count, 3)) * (0.0 if same_place else 1.0)
    ties = csr_array(random.random((count, count)) < 0.05, dtype=np.float64)
    order = elimination_order(points, csr_array(ties + ties.T))
    np.testing.assert_array_equal(np.sort(order), np.arange(count))


def test_factors_are_smaller_than_in_the_given_order() -> None:
    points, matrix = grid(60)
    order = elimination_order(points, matrix)
    mixed = np.random.default_rng(0).permutation(len(points))
    entries = [factored(csr_array(matrix[rows][:, rows])).L.nnz for rows in (order, np.arange(len(points)), mixed)]
    assert entries[0] < 0.5 * entries[1] < entries[2]


def test_growth_is_close_to_linear() -> None:
    entries = []
    for side in (32, 64):
        points, matrix = grid(side)
        order = elimination_order(points, matrix)
        entries.append(factored(csr_array(matrix[order][:, order])).L.nnz)
    # Nested dissection has n log n entries: four times the unknowns, less than six times the entries.
    assert entries[1] < 6 * entries[0]


@pytest.mark.parametrize("side", [1, 2, 20])
def test_solutions(side: int) -> None:
    points, matrix = grid(side)
    order = elimination_order(points, matrix)
    exact = np.random.default_rng(side).normal(size=(side * side, 2))
    solved = np.empty_like(exact)
    solved[order] = factored(csr_array(matrix[order][:, order])).solve((matrix @ exact)[order])
    np.testing.assert_allclose(solved, exact, rtol=0.0, atol=1e-10)
