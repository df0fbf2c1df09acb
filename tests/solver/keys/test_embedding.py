# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Both keys in the cube and back, the rigid motion between them, and still vertices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.keys.embedding import MARGIN, STILL_TOLERANCE, Embedding, RigidMotion
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.triangles.geometry import vertex_areas

from ..meshes import bent, box_surface, icosphere

seeds = st.integers(0, 2**32 - 1)
vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)
angles = st.sampled_from([0.0, 1e-12, 1e-7, 0.99e-4, 1.01e-4, 1e-3, 0.1, 1.0, 3.0, 3.141])


def rigidly_moved(points: Floats, turn: Floats, shift: Floats) -> Floats:
    return np.asarray(points @ rotation_matrices(turn[None])[0].T + shift)


def bar_pair(turn: Floats, shift: Floats, angle: float = 0.6) -> KeyPair:
    points, faces = box_surface((2, 2, 8), (1.0, 0.7, 4.0))
    return KeyPair.checked(points, rigidly_moved(bent(points, angle), turn, shift), faces)


def plate_with_wings(plate: Floats, angle: float) -> Floats:
    """A plate along y whose outer thirds are turned up by ``angle`` (radians) about the x axis."""
    inner = np.ptp(plate[:, 1]) / 6.0
    hinge = np.sign(plate[:, 1:2]) * inner * np.array([0.0, 1.0, 0.0])
    turns = np.outer(angle * np.sign(plate[:, 1]) * (np.abs(plate[:, 1]) > inner), [1.0, 0.0, 0.0])
    return np.asarray(np.einsum("nij,nj->ni", rotation_matrices(turns), plate - hinge) + hinge)


class TestRigidMotion:
    @given(seeds, vectors, angles, st.floats(0.0, 10.0))
    def test_a_rigid_motion_is_recovered(self, seed: int, axis: Floats, angle: float, far: float) -> None:
        random = np.random.default_rng(seed)
        source = random.normal(size=(30, 3))
        turn = angle * axis / max(np.linalg.norm(axis), 1e-3)
        target = rigidly_moved(source, turn, far * random.normal(size=3))
        motion = RigidMotion.between(source, target, random.uniform(0.1, 1.0, 30))
        np.testing.assert_allclose(motion.apply(source), target, rtol=0.0, atol=1e-12 * (1.0 + far))
        np.testing.assert_allclose(motion.turn, turn, rtol=0.0, atol=1e-12)

    @given(vectors, vectors, angles)
    def test_undoing_is_exact(self, axis: Floats, velocity: Floats, angle: float) -> None:
        points = np.random.default_rng(0).normal(size=(20, 3))
        motion = RigidMotion(angle * axis, velocity)
        np.testing.assert_allclose(motion.undo(motion.apply(points)), points, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(motion.apply(motion.undo(points)), points, rtol=0.0, atol=1e-14)

    @given(vectors, vectors, angles, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
    def test_times_add_up(self, axis: Floats, velocity: Floats, angle: float, first: float, second: float) -> None:
        points = np.random.default_rng(0).normal(size=(20, 3))
        motion = RigidMotion(angle * axis, velocity)
        twice = motion.apply(motion.apply(points, first), second)
        np.testing.assert_allclose(twice, motion.apply(points, first + second), rtol=0.0, atol=1e-13)

    def test_a_quarter_turn_about_a_distant_axis(self) -> None:
        # The screw's axis is x = 3, y = 4; on it everything only rises.
        source = np.array([[3.0, 4.0, 0.0], [5.0, 4.0, 0.0], [3.0, 6.0, 1.0], [4.0, 4.0, 7.0]])
        offsets = source - [3.0, 4.0, 0.0]
        target = np.column_stack([-offsets[:, 1], offsets[:, 0], offsets[:, 2]]) + [3.0, 4.0, 2.0]
        motion = RigidMotion.between(source, target, np.ones(4))
        half = np.sqrt(0.5)
        expected = [[3.0, 4.0, 1.0], [3.0 + 2.0 * half, 4.0 + 2.0 * half, 1.0]]
        np.testing.assert_allclose(motion.apply(source, 0.5)[:2], expected, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(motion.apply(source, 0.0), source, rtol=0.0, atol=0.0)

    def test_a_translation_is_straight(self) -> None:
        source = np.random.default_rng(0).normal(size=(10, 3))
        motion = RigidMotion.between(source, source + [3.0, -2.0, 1.0], np.ones(10))
        np.testing.assert_allclose(motion.apply(source, 0.25), source + [0.75, -0.5, 0.25], rtol=0.0, atol=1e-13)

    @pytest.mark.parametrize("direction", np.eye(3).tolist() + [[1.0, 2.0, 3.0], [-0.3, 0.1, 0.2]])
    def test_points_in_a_line_do_not_spin(self, direction: list[float]) -> None:
        # About the line itself every turn fits equally well: a shift must stay a shift.
        source = np.linspace(-1.0, 1.0, 5)[:, None] * np.array(direction)
        shift = np.array([0.4, -0.5, 0.6])
        motion = RigidMotion.between(source, source + shift, np.ones(5))
        np.testing.assert_allclose(motion.apply(source, 0.5), source + 0.5 * shift, rtol=0.0, atol=1e-12)

    def test_a_line_turns_as_little_as_it_can(self) -> None:
        source = np.linspace(-1.0, 1.0, 5)[:, None] * np.array([1.0, 0.0, 0.0])
        motion = RigidMotion.between(source, source[:, [1, 0, 2]] + [0.0, 0.0, 3.0], np.ones(5))
        np.testing.assert_allclose(motion.turn, [0.0, 0.0, 0.5 * np.pi], rtol=0.0, atol=1e-14)
        back = RigidMotion.between(source, -source, np.ones(5))
        assert np.linalg.norm(back.turn) == pytest.approx(np.pi, abs=1e-12)
        np.testing.assert_allclose(back.apply(source), -source, rtol=0.0, atol=1e-14)

    def test_points_in_one_place_are_carried_along(self) -> None:
        source = np.ones((3, 3))
        motion = RigidMotion.between(source, source + [1.0, 2.0, 3.0], np.ones(3))
        np.testing.assert_allclose(motion.apply(source, 0.5), source + [0.5, 1.0, 1.5], rtol=0.0, atol=1e-14)

    def test_a_mirrored_shape_gets_a_rotation(self) -> None:
        source = np.random.default_rng(0).normal(size=(10, 3))
        motion = RigidMotion.between(source, source * [-1.0, 1.0, 1.0], np.ones(10))
        moved = motion.apply(source)
        np.testing.assert_allclose(np.linalg.norm(moved[0] - moved[1]), np.linalg.norm(source[0] - source[1]))

    def test_heavy_points_count_more(self) -> None:
        source = np.random.default_rng(0).normal(size=(20, 3))
        target = rigidly_moved(source, np.array([0.3, 0.1, -0.2]), np.array([1.0, 2.0, 3.0]))
        disturbed = target.copy()
        disturbed[0] += 1.0
        weights = np.ones(20)
        weights[0] = 1e-12
        motion = RigidMotion.between(source, disturbed, weights)
        np.testing.assert_allclose(motion.apply(source), target, rtol=0.0, atol=1e-10)


class TestMotionOfASurface:
    @given(seeds, vectors, angles)
    def test_a_rigid_motion_is_recovered(self, seed: int, axis: Floats, angle: float) -> None:
        points, faces = icosphere(1)
        points = points + 0.1 * np.random.default_rng(seed).normal(size=points.shape)
        turn = angle * axis / max(np.linalg.norm(axis), 1e-3)
        target = rigidly_moved(points, turn, 3.0 * axis)
        motion = RigidMotion.of_surface(points, target, faces)
        np.testing.assert_allclose(motion.apply(points), target, rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(motion.turn, turn, rtol=0.0, atol=1e-11)

    @pytest.mark.parametrize("lift", [0.0, 0.01])
    @pytest.mark.parametrize("angle", [0.3, 0.7, 1.5])
    def test_wings_that_flap_do_not_turn_the_body_over(self, angle: float, lift: float) -> None:
        plate, faces = box_surface((2, 20, 2), (1.0, 8.0, 0.2))
        down, up = (plate_with_wings(plate, sign * angle) for sign in (-1.0, 1.0))
        motion = RigidMotion.of_surface(down, up + [0.0, 0.0, lift], faces)
        # The diagonals of the hinges' faces are not symmetric.
        np.testing.assert_allclose(motion.turn, 0.0, rtol=0.0, atol=0.01)

    def test_ends_that_twist_more_than_half_a_turn_either_way_cancel_out(self) -> None:
        bar, faces = box_surface((3, 3, 31), (1.0, 1.0, 5.0))
        turns = np.outer(np.radians(440.0) * (bar[:, 2] / 5.0 - 0.5), [0.0, 0.0, 1.0])
        motion = RigidMotion.of_surface(bar, np.einsum("nij,nj->ni", rotation_matrices(turns), bar), faces)
        np.testing.assert_allclose(motion.turn, 0.0, rtol=0.0, atol=1e-9)

    def test_there_and_back_are_one_motion(self) -> None:
        points, faces = box_surface((2, 2, 8), (1.0, 0.7, 4.0))
        other = 2.0 * rigidly_moved(bent(points, 1.0), np.array([0.5, -1.0, 0.8]), np.ones(3))
        there, back = (RigidMotion.of_surface(*ends, faces) for ends in ((points, other), (other, points)))
        np.testing.assert_allclose(there.turn, -back.turn, rtol=0.0, atol=1e-11)

    def test_without_triangles_the_points_tell(self) -> None:
        points = np.random.default_rng(0).normal(size=(10, 3))
        turn = np.array([0.5, -1.0, 0.8])
        for faces in (np.empty((0, 3), dtype=np.int64), np.zeros((2, 3), dtype=np.int64)):
            motion = RigidMotion.of_surface(points, rigidly_moved(points, turn, np.ones(3)), faces)
            np.testing.assert_allclose(motion.turn, turn, rtol=0.0, atol=1e-12)


class TestEmbedding:
    @given(seeds, st.sampled_from([1e-6, 1.0, 1e6]), vectors)
    def test_both_keys_lie_in_the_cube_and_touch_its_margin(self, seed: int, size: float, place: Floats) -> None:
        random = np.random.default_rng(seed)
        key0, key1 = size * (random.normal(size=(2, 30, 3)) + 10.0 * place)
        embedding = Embedding.of(KeyPair.checked(key0, key1, random.integers(0, 30, size=(20, 3))))
        both = np.concatenate([embedding.key0, embedding.key1])
        assert both.min() >= MARGIN - 1e-12
        assert both.max() <= 1.0 - MARGIN + 1e-12
        assert np.ptp(both, axis=0).max() == pytest.approx(1.0 - 2.0 * MARGIN, abs=1e-12)
        assert np.abs(both.min(axis=0) + both.max(axis=0) - 1.0).max() < 1e-12

    @pytest.mark.parametrize("angle", [0.0, 1e-5, 1e-3, 1.0, 3.1])
    def test_exactly_invertible(self, angle: float) -> None:
        pair = bar_pair(angle * np.array([2.0, -1.0, 2.0]) / 3.0, np.array([5.0, -3.0, 8.0]))
        embedding = Embedding.of(pair)
        assert not embedding.still.any()
        tolerance = 4e-15 * np.abs(pair.key1).max()
        np.testing.assert_allclose(embedding.from_cube(embedding.key0, 0.0), pair.key0, rtol=0.0, atol=tolerance)
        np.testing.assert_allclose(embedding.from_cube(embedding.key1, 1.0), pair.key1, rtol=0.0, atol=4.0 * tolerance)
        cube = np.random.default_rng(0).uniform(size=(50, 3))
        np.testing.assert_allclose(embedding.to_cube(embedding.from_cube(cube, 0.0)), cube, rtol=0.0, atol=1e-14)

    def test_one_similarity_for_both_keys(self) -> None:
        points, faces = icosphere(1)
        embedding = Embedding.of(KeyPair.checked(points, 2.0 * points - 0.3, faces))
        for key, cube in ((embedding.pair.key0, embedding.key0), (embedding.pair.key1, embedding.key1)):
            lengths, scaled = (np.linalg.norm(one - one[0], axis=1)[1:] for one in (key, cube))
            np.testing.assert_allclose(scaled / lengths, embedding.scale, rtol=1e-12)

    def test_a_rigid_motion_is_taken_out_and_put_back(self) -> None:
        points, faces = box_surface((2, 2, 8), (1.0, 0.7, 4.0))
        turn, shift = np.array([0.5, -1.0, 0.8]), np.array([3.0, 4.0, -5.0])
        pair = KeyPair.checked(points, rigidly_moved(points, turn, shift), faces)
        embedding = Embedding.of(pair)
        np.testing.assert_allclose(embedding.key1, embedding.key0, rtol=0.0, atol=2e-13)
        halfway = embedding.from_cube(embedding.key0, 0.5)
        rest = embedding.motion.apply(halfway @ embedding.axes.T, 0.5) @ embedding.axes
        np.testing.assert_allclose(rest, pair.key1, rtol=0.0, atol=2e-12)
        distances, kept = (np.linalg.norm(one - one[0], axis=1) for one in (points, halfway))
        np.testing.assert_allclose(kept, distances, rtol=0.0, atol=1e-13)

    def test_what_is_left_has_no_rotation(self) -> None:
        embedding = Embedding.of(bar_pair(np.array([0.5, -1.0, 0.8]), np.array([3.0, 4.0, -5.0])))
        left = RigidMotion.of_surface(embedding.key0, embedding.key1, embedding.pair.faces)
        np.testing.assert_allclose(left.turn, 0.0, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(left.velocity, 0.0, rtol=0.0, atol=1e-12)

    def test_a_still_part_forbids_a_rigid_motion(self) -> None:
        points, faces = box_surface((2, 2, 8), (1.0, 0.7, 4.0))
        moved = rigidly_moved(points, np.array([0.5, -1.0, 0.8]), np.array([3.0, 4.0, -5.0]))
        still = points[:, 2] <= 2.0
        moved[still] = points[still]
        embedding = Embedding.of(KeyPair.checked(points, moved, faces))
        np.testing.assert_array_equal(embedding.still, still)
        np.testing.assert_array_equal(embedding.motion.apply(points, 0.7), points)
        np.testing.assert_array_equal(embedding.key1[still], embedding.key0[still])

    def test_one_still_vertex_counts_a_little(self) -> None:
        points, faces = box_surface((6, 6, 40), (1.0, 0.7, 4.0))
        turn = np.array([0.5, -1.0, 0.8])
        turns = []
        for short in (0.0, 0.9e-6, 1.1e-6, 1e-5, 1e-4, 1e-3, 1.0):
            moved = rigidly_moved(points, turn, np.array([3.0, 4.0, -5.0]))
            moved[5] = points[5] + short * (moved[5] - points[5])
            embedding = Embedding.of(KeyPair.checked(points, moved, faces))
            turns.append(np.linalg.norm(embedding.motion.turn))
            for time in (0.0, 0.3, 1.0):
                line = points + time * (moved - points)
                found = embedding.from_cube(embedding.straight(time), time)
                np.testing.assert_allclose(found, line, rtol=0.0, atol=1e-13)
        assert np.abs(np.diff(turns)).max() < 0.01
        assert turns[-1] == pytest.approx(np.linalg.norm(turn), abs=1e-12)

    def test_still_up_to_a_millionth_of_the_size(self) -> None:
        points, faces = box_surface((2, 2, 2), (3.0, 4.0, 12.0))
        moved = points + 1.0
        moved[:4] = points[:4]
        axes = Embedding.of(KeyPair.checked(points, moved, faces)).axes
        diagonal = np.linalg.norm(np.ptp(points @ axes.T, axis=0))
        moved[1, 0] += 0.99 * STILL_TOLERANCE * diagonal
        moved[2, 1] += 1.01 * STILL_TOLERANCE * diagonal
        embedding = Embedding.of(KeyPair.checked(points, moved, faces))
        assert np.flatnonzero(embedding.still).tolist() == [0, 1, 3]
        unmoved = [0, 3]
        line = embedding.from_cube(embedding.straight(0.3), 0.3)
        np.testing.assert_allclose(line[unmoved], points[unmoved], rtol=0.0, atol=1e-13)

    def test_equal_keys_are_all_still(self) -> None:
        points, faces = icosphere(1)
        embedding = Embedding.of(KeyPair.checked(points, points, faces))
        assert embedding.still.all()
        np.testing.assert_array_equal(embedding.key1, embedding.key0)

    def test_weights_are_the_areas(self) -> None:
        embedding = Embedding.of(bar_pair(np.zeros(3), np.ones(3)))
        areas = vertex_areas(embedding.pair.key0, *embedding.pair.covering)
        assert areas.sum() == pytest.approx(2.0 * 0.7 + 2.0 * 4.0 + 2.0 * 2.8, rel=1e-12)
        np.testing.assert_allclose(embedding.weights, areas / areas.sum(), rtol=1e-12)

    def test_loose_vertices_have_a_small_area(self) -> None:
        points = np.concatenate([icosphere(1)[0], [[0.0, 0.0, 0.0]]])
        areas = vertex_areas(points, icosphere(1)[1])
        assert 0.0 < areas[-1] < 0.01 * areas[0]
        np.testing.assert_array_equal(vertex_areas(points, np.empty((0, 3), dtype=np.int64)), 1.0)
