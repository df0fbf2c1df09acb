# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Coincident vertices, edges, neighbors and closed components of triangle meshes in every state that artists leave."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Ints
from qc3d_addon.solver.triangles.topology import (
    among,
    closed_faces,
    distinct,
    face_adjacency,
    sides,
    unique_edges,
    vertex_components,
    welded,
)

from ..meshes import box_surface, icosphere

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
faces_of_anything = st.lists(
    st.permutations(range(8)).map(lambda order: order[:3]), min_size=1, max_size=20
).map(np.array)


numbers = st.lists(st.integers(-20, 20), max_size=40).map(lambda values: np.array(values, dtype=np.int64))


@given(numbers, numbers)
def test_distinct_numbers_and_which_are_among_them(values: Ints, others: Ints) -> None:
    known = distinct(values)
    assert known.tolist() == sorted(set(values.tolist()))
    assert among(others, known).tolist() == [other in set(values.tolist()) for other in others.tolist()]


def closed(faces: Ints, count: int | None = None) -> list[bool]:
    labels = vertex_components(unique_edges(sides(faces)), int(faces.max()) + 1 if count is None else count)
    return closed_faces(faces, labels).tolist()


class TestWelded:
    def test_positions_come_back(self) -> None:
        random = np.random.default_rng(0)
        key0, key1 = random.normal(size=(2, 20, 3))
        again = random.permutation(np.concatenate([np.arange(20), random.integers(0, 20, 15)]))
        representatives, group = welded(key0[again], key1[again])
        assert len(representatives) == 20
        np.testing.assert_array_equal(key0[again][representatives][group], key0[again])
        np.testing.assert_array_equal(key1[again][representatives][group], key1[again])

    def test_order_of_the_mesh_is_kept(self) -> None:
        key = np.array([[3.0, 0, 0], [1, 0, 0], [3, 0, 0], [2, 0, 0], [1, 0, 0]])
        representatives, group = welded(key, key)
        assert representatives.tolist() == [0, 1, 3]
        assert group.tolist() == [0, 1, 0, 2, 1]

    def test_vertices_that_part_in_the_second_key_stay_apart(self) -> None:
        key0 = np.zeros((3, 3))
        key1 = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]])
        assert welded(key0, key1)[1].tolist() == [0, 1, 0]
        assert welded(key1, key0)[1].tolist() == [0, 1, 0]

    def test_zero_is_zero_whatever_its_sign(self) -> None:
        key = np.array([[0.0, 1.0, 0.0], [-0.0, 1.0, 0.0]])
        assert welded(key, key)[1].tolist() == [0, 0]

    @given(st.integers(0, 2**32 - 1), st.sampled_from([1e-6, 1.0, 1e6]))
    def test_copies_within_the_reach_of_both_keys(self, seed: int, size: float) -> None:
        random = np.random.default_rng(seed)
        key0, key1 = size * random.uniform(1.0, 9.0, size=(2, 20, 3)).round(1)
        again = random.permutation(np.concatenate([np.arange(20), random.integers(0, 20, 15)]))
        reach = (1e-6 * size, 3e-6 * size)
        moved0, moved1 = (
            key[again] + random.uniform(-0.5, 0.5, size=(35, 3)) * one
            for key, one in zip((key0, key1), reach, strict=True)
        )
        representatives, group = welded(moved0, moved1, reach)
        np.testing.assert_array_equal(again[representatives][group], again)
        assert len(representatives) == 20
        assert len(welded(moved0, moved1)[0]) == len(np.unique(np.concatenate([moved0, moved1], axis=1), axis=0))

    @pytest.mark.parametrize("parted", [0, 1])
    def test_copies_must_be_within_the_reach_in_both_keys(self, parted: int) -> None:
        keys = [np.zeros((2, 3)), np.zeros((2, 3))]
        keys[parted][1, 1] = 2e-6
        assert welded(*keys, (1e-6, 1e-6))[1].tolist() == [0, 1]

    def test_ends_of_an_edge_are_no_copies(self) -> None:
        # Three copies in a row, and a tiny triangle whose first corner also exists twice, exactly.
        key = np.array([[0.0, 0, 0], [1e-6, 0, 0], [2e-6, 0, 0], [5, 0, 0], [5 + 1e-6, 0, 0], [5, 1e-6, 0], [5, 0, 0]])
        triangle = np.array([[3, 4], [4, 5], [3, 5]])
        assert welded(key, key, (1.5e-6, 1.5e-6))[1].tolist() == [0, 0, 0, 1, 1, 1, 1]
        assert welded(key, key, (1.5e-6, 1.5e-6), triangle)[1].tolist() == [0, 0, 0, 1, 2, 3, 1]

    def test_a_key_in_one_point_does_not_slow_the_search(self) -> None:
        key = np.random.default_rng(0).uniform(size=(30_000, 3))
        for keys in ((key, np.zeros_like(key)), (np.ones_like(key), key)):
            assert len(welded(*keys, (1e-7, 1e-7))[0]) == len(key)

    def test_a_sphere_of_single_triangles_becomes_one(self) -> None:
        points, faces = icosphere(1)
        loose = points[faces.ravel()]
        representatives, group = welded(loose, 2.0 * loose)
        assert len(representatives) == len(points)
        assert all(closed(group.reshape(-1, 3)))


class TestEdges:
    def test_sides(self) -> None:
        assert sides(np.array([[5, 1, 3], [0, 2, 1]])).tolist() == [[1, 5], [0, 2], [1, 3], [1, 2], [3, 5], [0, 1]]

    def test_unique_edges(self) -> None:
        found = unique_edges(np.array([[2, 1], [1, 2], [3, 3], [0, 1], [2, 1]]))
        assert found.tolist() == [[0, 1], [1, 2]]
        assert unique_edges(np.empty((0, 2), dtype=np.int64)).shape == (0, 2)

    def test_a_closed_surface_has_three_edges_for_two_faces(self) -> None:
        faces = icosphere(2)[1]
        assert len(unique_edges(sides(faces))) == 3 * len(faces) // 2


class TestFaceAdjacency:
    def test_two_neighbors_for_every_edge_of_a_closed_surface(self) -> None:
        faces = icosphere(1)[1]
        pairs = face_adjacency(faces)
        assert len(pairs) == 3 * len(faces) // 2
        assert np.bincount(pairs.ravel()).tolist() == [3] * len(faces)
        shared = [len(set(faces[a]) & set(faces[b])) for a, b in pairs]
        assert shared == [2] * len(pairs)

    def test_open_edges_have_none(self) -> None:
        assert face_adjacency(np.array([[0, 1, 2]])).shape == (0, 2)
        assert face_adjacency(np.empty((0, 3), dtype=np.int64)).shape == (0, 2)

    def test_many_triangles_around_one_edge_form_a_chain(self) -> None:
        fan = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4], [5, 0, 1]])
        pairs = face_adjacency(fan)
        assert len(pairs) == 3
        assert set(vertex_components(pairs, 4).tolist()) == {0}

    @given(faces_of_anything)
    def test_exactly_the_faces_with_common_edges_hang_together(self, faces: Ints) -> None:
        pairs = face_adjacency(faces)
        edges = [{frozenset((face[i], face[i - 1])) for i in range(3)} for face in faces.tolist()]
        assert all(edges[a] & edges[b] for a, b in pairs)
        labels = vertex_components(pairs, len(faces))
        for a, first in enumerate(edges):
            for b, second in enumerate(edges):
                if first & second:
                    assert labels[a] == labels[b]


class TestComponents:
    def test_labels(self) -> None:
        labels = vertex_components(np.array([[0, 3], [1, 4]]), 6)
        assert labels[0] == labels[3]
        assert labels[1] == labels[4]
        assert len(set(labels.tolist())) == 4

    def test_no_edges(self) -> None:
        assert vertex_components(np.empty((0, 2), dtype=np.int64), 3).tolist() == [0, 1, 2]


class TestClosedFaces:
    def test_closed_surfaces(self) -> None:
        assert all(closed(TETRAHEDRON))
        assert all(closed(icosphere(2)[1]))
        assert all(closed(box_surface((2, 3, 4), (1.0, 1.0, 1.0))[1]))

    def test_a_hole_opens_the_whole_component_and_no_other(self) -> None:
        faces = np.concatenate([TETRAHEDRON[1:], TETRAHEDRON + 4, TETRAHEDRON[:2] + 8])
        assert closed(faces) == [False] * 3 + [True] * 4 + [False] * 2

    def test_a_fin_opens_the_component(self) -> None:
        assert not any(closed(np.concatenate([TETRAHEDRON, [[0, 1, 4]]])))

    def test_normals_that_disagree_enclose_no_volume(self) -> None:
        flipped = TETRAHEDRON.copy()
        flipped[2] = flipped[2, ::-1]
        assert not any(closed(flipped))
        # All turned inside out they agree again.
        assert all(closed(TETRAHEDRON[:, ::-1]))

    def test_loose_vertices_do_not_matter(self) -> None:
        assert all(closed(TETRAHEDRON + 2, count=9))

    def test_no_faces(self) -> None:
        assert closed(np.empty((0, 3), dtype=np.int64), count=3) == []
        assert closed(np.empty((0, 3), dtype=np.int64), count=0) == []

    @pytest.mark.parametrize("missing", range(4))
    def test_whichever_face_is_missing(self, missing: int) -> None:
        assert not any(closed(np.delete(TETRAHEDRON, missing, axis=0)))
