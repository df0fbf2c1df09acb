# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields of rotations beyond half a turn, recovered from rotations that know their angle only up to full turns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.branches import consistent_branches
from qc3d_addon.solver.rotations import rotation_matrices, rotation_vectors
from qc3d_addon.solver.surface import TriangleDeformation
from qc3d_addon.solver.tetmesh import Floats, Ints
from qc3d_addon.solver.topology import face_adjacency

from .meshes import bent, box_surface, twisted

BAR, FACES = box_surface((2, 2, 24), (1.0, 1.0, 5.0))


def chain(count: int) -> Ints:
    """Elements in a row."""
    return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)


def forgotten(turns: Floats) -> Floats:
    """The rotation vectors that the rotations alone tell: angles up to half a turn."""
    return rotation_vectors(rotation_matrices(turns))


def assert_recovered(turns: Floats, adjacency: Ints) -> None:
    assert np.abs(forgotten(turns) - turns).max() > 1.0
    np.testing.assert_allclose(consistent_branches(forgotten(turns), adjacency), turns, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("degrees", [200.0, 270.0, 450.0, 720.0, 1500.0])
def test_a_twisted_bar(degrees: float) -> None:
    heights = BAR[FACES].mean(axis=1)[:, 2] / 5.0
    turns = np.radians(degrees) * heights[:, None] * np.array([0.0, 0.0, 1.0])
    assert_recovered(turns, face_adjacency(FACES))


def test_a_bent_bar_turns_both_ways_from_its_middle() -> None:
    heights = BAR[FACES].mean(axis=1)[:, 2] / 5.0 - 0.5
    assert_recovered(np.radians(500.0) * heights[:, None] * np.array([0.0, 1.0, 0.0]), face_adjacency(FACES))


def test_two_limbs_turn_opposite_ways() -> None:
    along = np.linspace(0.0, np.radians(250.0), 20)[:, None]
    left, right = along * np.array([0.6, 0.0, 0.8]), -along[1:] * np.array([0.6, 0.0, 0.8])
    limbs = np.concatenate([chain(20), [[0, 20]], 20 + chain(19)])
    assert_recovered(np.concatenate([left, right]), limbs)


def test_each_part_starts_where_it_turns_least() -> None:
    turns = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 2.0], [0.0, 0.0, 4.0]])
    both = np.concatenate([turns, -turns])
    adjacency = np.array([[0, 1], [0, 2], [3, 4], [3, 5]])
    np.testing.assert_allclose(consistent_branches(forgotten(both), adjacency), both, rtol=0.0, atol=1e-13)


def test_a_jump_is_crossed_last() -> None:
    # A ring whose turn grows by 300 degrees on the way round: the cut lies between its last and its first element.
    turns = np.linspace(0.0, np.radians(300.0), 16)[:, None] * np.array([1.0, 0.0, 0.0])
    ring = np.concatenate([[[15, 0]], chain(16)])
    assert_recovered(turns, ring)


def test_order_and_repetition_of_neighbours_do_not_matter() -> None:
    turns = np.linspace(0.0, 8.0, 30)[:, None] * np.array([0.0, 0.6, 0.8])
    pairs = np.concatenate([chain(30), chain(30)[::-1, ::-1], chain(30)])
    assert_recovered(turns, pairs)


def test_elements_without_neighbours_stay() -> None:
    turns = np.random.default_rng(0).normal(size=(5, 3))
    alone = np.empty((0, 2), dtype=np.int64)
    np.testing.assert_array_equal(consistent_branches(turns, alone), turns)
    assert consistent_branches(np.empty((0, 3)), alone).shape == (0, 3)


def test_equal_rotations_hang_together() -> None:
    # No relative rotation at all is the shortest way from element to element, not a missing one.
    angles = np.concatenate([np.zeros(3), np.linspace(0.0, 5.0, 12), np.full(3, 5.0)])
    turns = angles[:, None] * np.array([0.0, 1.0, 0.0])
    assert_recovered(turns, chain(len(turns)))


@given(st.integers(0, 2**32 - 1))
def test_rotations_stay_what_they_are(seed: int) -> None:
    random = np.random.default_rng(seed)
    turns = forgotten(random.normal(scale=3.0, size=(40, 3)))
    found = consistent_branches(turns, random.integers(0, 40, size=(60, 2)))
    np.testing.assert_allclose(rotation_matrices(found), rotation_matrices(turns), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("degrees", [180.0, 225.0, 270.0])
def test_triangles_of_a_twisted_bar(degrees: float) -> None:
    deformation = TriangleDeformation.between(BAR, twisted(BAR, np.radians(degrees)), FACES)
    turns = consistent_branches(deformation.turns, face_adjacency(deformation.faces))
    expected = np.radians(degrees) * BAR[FACES].mean(axis=1)[:, 2] / 5.0
    # A twisted face also leans; half a turn more or less would be an error of pi.
    assert np.abs(turns[:, 2] - expected).max() < 0.25 * np.pi


@pytest.mark.parametrize("degrees", [180.0, 300.0])
def test_triangles_of_a_bent_bar(degrees: float) -> None:
    deformation = TriangleDeformation.between(BAR, bent(BAR, np.radians(degrees)), FACES)
    turns = consistent_branches(deformation.turns, face_adjacency(deformation.faces))
    expected = np.radians(degrees) * (BAR[FACES].mean(axis=1)[:, 2] / 5.0 - 0.5)
    np.testing.assert_allclose(turns[:, 1], expected, rtol=0.0, atol=0.15)
    np.testing.assert_allclose(turns[:, [0, 2]], 0.0, rtol=0.0, atol=1e-9)
