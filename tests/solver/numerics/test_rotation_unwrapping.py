# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Angles beyond half a turn, recovered from rotations that determine them only up to full turns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Bools, Floats, Ints
from qc3d_addon.solver.numerics.rotation_unwrapping import Turning, consistent_turning, mean_turns, swing_beside
from qc3d_addon.solver.numerics.rotations import rotation_matrices, rotation_vectors
from qc3d_addon.solver.triangles.deformation import TriangleDeformation
from qc3d_addon.solver.triangles.topology import face_adjacency

from ..meshes import bent, box_surface, twisted

BAR, FACES = box_surface((2, 2, 24), (1.0, 1.0, 5.0))
HEIGHTS = BAR[FACES].mean(axis=1)[:, 2] / 5.0


def chain(count: int) -> Ints:
    """Elements in a row."""
    return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)


def forgotten(turns: Floats) -> Floats:
    """The rotation vectors that the rotations alone tell: angles up to half a turn."""
    return rotation_vectors(rotation_matrices(turns))


def found(turns: Floats, adjacency: Ints, held: Bools | None = None) -> Turning:
    held = np.zeros(len(turns), dtype=bool) if held is None else held
    centers = np.column_stack([np.arange(len(turns)), np.zeros((len(turns), 2))])
    return consistent_turning(turns, adjacency, centers, np.ones(len(turns)), held)


def assert_recovered(turns: Floats, adjacency: Ints, held: Bools | None = None) -> None:
    assert np.abs(forgotten(turns) - turns).max() > 1.0
    turning = found(forgotten(turns), adjacency, held=held)
    for time in (0.0, 0.3, 0.5, 1.0):
        np.testing.assert_allclose(turning.at(time), rotation_matrices(time * turns), rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(turning.angles, np.linalg.norm(turns, axis=1), rtol=0.0, atol=1e-11)


class TestKnownTurns:
    @pytest.mark.parametrize("degrees", [-200.0, 200.0, 270.0, 450.0, 720.0, 1500.0])
    def test_a_twisted_bar(self, degrees: float) -> None:
        turns = np.radians(degrees) * HEIGHTS[:, None] * np.array([0.0, 0.0, 1.0])
        assert_recovered(turns, face_adjacency(FACES))

    def test_a_bent_bar_turns_both_ways_from_its_middle(self) -> None:
        turns = np.radians(500.0) * (HEIGHTS[:, None] - 0.5) * np.array([0.0, 1.0, 0.0])
        assert_recovered(turns, face_adjacency(FACES))

    def test_two_limbs_turn_opposite_ways(self) -> None:
        along = np.linspace(0.0, np.radians(250.0), 20)[:, None]
        left, right = along * np.array([0.6, 0.0, 0.8]), -along[1:] * np.array([0.6, 0.0, 0.8])
        limbs = np.concatenate([chain(20), [[0, 20]], 20 + chain(19)])
        assert_recovered(np.concatenate([left, right]), limbs)

    def test_each_part_starts_where_it_turns_least(self) -> None:
        turns = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 2.0], [0.0, 0.0, 4.0]])
        both = np.concatenate([turns, -turns])
        assert_recovered(both, np.array([[0, 1], [0, 2], [3, 4], [3, 5]]), np.ones(6, dtype=bool))

    def test_a_button_goes_the_way_of_the_sleeve(self) -> None:
        sleeve = np.linspace(0.0, np.radians(230.0), 12)[:, None] * np.array([0.0, 1.0, 0.0])
        button = np.broadcast_to(np.radians(228.0) * np.array([0.0, 1.0, 0.0]), (2, 3))
        assert_recovered(np.concatenate([sleeve, button]), np.concatenate([chain(12), [[12, 13]]]))

    def test_rounding_does_not_choose_the_largest_of_parts_of_one_size(self) -> None:
        """Pieces that are all alike, such as leaves, and that turn by nearly half a turn one way or the other."""
        angles = np.radians([170.0, 170.0, -170.0, -170.0])
        turns, edges = angles[:, None] * np.array([0.0, 0.0, 1.0]), np.array([[0, 1], [2, 3]])
        centers, loose = np.zeros((4, 3)), np.zeros(4, dtype=bool)
        sizes = [np.array([1.0, 1.0, 1.0 + less, 1.0]) for less in (-1e-15, 0.0, 1e-15)]
        ways = [consistent_turning(turns, edges, centers, size, loose).swing for size in sizes]
        np.testing.assert_allclose(ways, np.broadcast_to(ways[0], (3, 4, 3)), rtol=0.0, atol=1e-12)

    def test_wings_beat_each_its_own_way(self) -> None:
        # From the tip to the body, where the other one begins.
        wing = np.radians(np.linspace(185.0, 125.0, 8))[:, None] * np.array([0.0, 0.0, 1.0])
        assert_recovered(np.concatenate([wing, -wing[:1:-1]]), np.concatenate([chain(8), 8 + chain(6)]))

    def test_parts_have_their_own_axes(self) -> None:
        along = np.linspace(0.0, 5.0, 12)[:, None]
        turns = np.concatenate([along * np.array([1.0, 0.0, 0.0]), along * np.array([0.0, -0.6, 0.8])])
        assert_recovered(turns, np.concatenate([chain(12), 12 + chain(12)]))

    def test_a_jump_is_crossed_last(self) -> None:
        # A ring whose turn grows by 300 degrees on the way round: the cut lies between its last and first element.
        turns = np.linspace(0.0, np.radians(300.0), 16)[:, None] * np.array([1.0, 0.0, 0.0])
        assert_recovered(turns, np.concatenate([[[15, 0]], chain(16)]))

    def test_order_and_repetition_of_neighbors_do_not_matter(self) -> None:
        turns = np.linspace(0.0, 8.0, 30)[:, None] * np.array([0.0, 0.6, 0.8])
        assert_recovered(turns, np.concatenate([chain(30), chain(30)[::-1, ::-1], chain(30)]))

    def test_equal_rotations_hang_together(self) -> None:
        # No relative rotation at all is the shortest way from element to element, not a missing one.
        angles = np.concatenate([np.zeros(3), np.linspace(0.0, 5.0, 12), np.full(3, 5.0)])
        assert_recovered(angles[:, None] * np.array([0.0, 1.0, 0.0]), chain(len(angles)))

    def test_changing_axes_below_a_full_turn(self) -> None:
        angles = np.linspace(0.0, 3.4, 40)
        lean = np.linspace(0.0, 0.8, 40)
        turns = angles[:, None] * np.column_stack([np.sin(lean), np.zeros(40), np.cos(lean)])
        assert np.abs(forgotten(turns) - turns).max() > 1.0
        np.testing.assert_allclose(found(forgotten(turns), chain(40)).swing, turns, rtol=0.0, atol=1e-12)


class TestAnyTurns:
    @given(st.integers(0, 2**32 - 1))
    def test_rotations_stay_what_they_are(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        turns = forgotten(random.normal(scale=3.0, size=(40, 3)))
        turning = found(turns, random.integers(0, 40, size=(60, 2)))
        np.testing.assert_allclose(turning.at(1.0), rotation_matrices(turns), rtol=0.0, atol=1e-11)
        np.testing.assert_array_equal(turning.at(0.0), np.broadcast_to(np.eye(3), (40, 3, 3)))

    def test_elements_without_neighbors_stay(self) -> None:
        turns = np.random.default_rng(0).normal(size=(5, 3))
        alone = np.empty((0, 2), dtype=np.int64)
        turning = found(turns, alone)
        np.testing.assert_array_equal(turning.swing, turns)
        np.testing.assert_array_equal(turning.twist, 0.0)
        assert found(np.empty((0, 3)), alone).at(0.5).shape == (0, 3, 3)

    @given(st.integers(0, 2**32 - 1))
    def test_swing_and_twist_make_the_rotation(self, seed: int) -> None:
        turns, twist = np.random.default_rng(seed).normal(scale=2.0, size=(2, 10, 3))
        swing = swing_beside(turns, twist)
        assert (np.linalg.norm(swing, axis=1) <= np.pi + 2e-4).all()  # the dead zone of half turns
        product = rotation_matrices(swing) @ rotation_matrices(twist)
        np.testing.assert_allclose(product, rotation_matrices(turns), rtol=0.0, atol=1e-12)


class TestTriangles:
    @staticmethod
    def halfway(key1: Floats) -> Floats:
        deformation = TriangleDeformation.between(BAR, key1, FACES)
        assert len(deformation.faces) == len(FACES)
        return found(deformation.turns, face_adjacency(deformation.faces)).at(0.5)

    @pytest.mark.parametrize("degrees", [180.0, 270.0, 450.0, 600.0])
    def test_of_a_twisted_bar(self, degrees: float) -> None:
        expected = rotation_matrices(0.5 * np.radians(degrees) * HEIGHTS[:, None] * np.array([0.0, 0.0, 1.0]))
        between = rotation_vectors(self.halfway(twisted(BAR, np.radians(degrees))) @ expected.transpose(0, 2, 1))
        # The faces of a twisted bar also lean; the wrong way round would be wrong by half a turn.
        assert np.linalg.norm(between, axis=1).max() < 0.35 * np.pi

    @pytest.mark.parametrize("degrees", [180.0, 300.0])
    def test_of_a_bent_bar(self, degrees: float) -> None:
        turns = np.radians(degrees) * (HEIGHTS[:, None] - 0.5) * np.array([0.0, 1.0, 0.0])
        halfway = self.halfway(bent(BAR, np.radians(degrees)))
        between = rotation_vectors(halfway @ rotation_matrices(-0.5 * turns))
        np.testing.assert_allclose(np.linalg.norm(between, axis=1), 0.0, rtol=0.0, atol=0.1)


def test_mean_turns_of_parts_and_of_none() -> None:
    swing, twist = np.diag([1.0, 3.0, 5.0])[[0, 0, 2]], np.diag([0.0, 0.0, 2.0])
    turning = Turning(swing * [[1.0], [3.0], [1.0]], twist)
    means = mean_turns(turning, np.array([3.0, 1.0, 1.0]), np.array([0, 0, 2]), 3)
    np.testing.assert_allclose(means[[0, 2]], [[1.5, 0.0, 0.0], [0.0, 0.0, 7.0]])
    assert np.isnan(means[1]).all()
