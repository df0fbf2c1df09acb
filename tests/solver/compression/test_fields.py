# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacements as numbers: plain, by levels, by the mesh's own modes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.compression import graph_modes as graph_modes_module
from qc3d_addon.solver.compression.fields import GROWTHS, Part, Space, analyzed, synthesized
from qc3d_addon.solver.compression.graph_modes import MOST_MODES, MOST_VERTICES, graph_modes, laplacian
from qc3d_addon.solver.compression.hierarchy import Hierarchy

from ..meshes import icosphere, jittered_grid, sine_map

MESH = jittered_grid(6, seed=0)


class TestHierarchy:
    @settings(max_examples=40, deadline=None)
    @given(st.integers(1, 80), st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from(GROWTHS))
    def test_every_number_is_within_a_step(self, count: int, seed: int, regular: bool, growth: float) -> None:
        random = np.random.default_rng(seed)
        points = random.integers(0, 3, size=(count, 3)) / 2.0 if regular else random.normal(size=(count, 3))
        hierarchy, field = Hierarchy(points), random.normal(size=(2, count, 3))
        free = random.random((count, 3)) < 0.8
        numbers = hierarchy.numbers(field, 0.01, growth, free, 0.5)
        made = hierarchy.field(numbers, 0.01, growth, free)
        assert np.abs(made - field)[:, free].max(initial=0.0) <= 0.005 + 1e-12
        assert not made[:, ~free].any()
        assert not numbers[:, ~free].any()
        np.testing.assert_array_equal(np.sort(hierarchy.order), np.arange(count))

    def test_what_is_linear_leaves_little(self) -> None:
        points = np.random.default_rng(0).uniform(size=(3000, 3))
        field = (points @ np.array([[0.0, 1.0, 0.2], [-1.0, 0.0, 0.3], [0.1, -0.3, 0.0]]))[None]
        hierarchy, free = Hierarchy(points), np.ones((3000, 3), dtype=bool)
        numbers = hierarchy.numbers(field, 0.01, 1.0, free, 0.5)
        assert np.abs(numbers).mean() < 0.03 * np.abs(field / 0.01).mean()

    def test_no_points_and_points_in_one_place(self) -> None:
        assert Hierarchy(np.zeros((0, 3))).order.shape == (0,)
        hierarchy, field = Hierarchy(np.zeros((40, 3))), np.ones((1, 40, 3))
        numbers = hierarchy.numbers(field, 0.5, 1.0, np.ones((40, 3), dtype=bool), 0.5)
        np.testing.assert_allclose(hierarchy.field(numbers, 0.5, 1.0, np.ones((40, 3), dtype=bool)), field, atol=0.25)

    @pytest.mark.parametrize("unit", [2.0**-30, 4096.0])
    def test_the_same_in_every_unit(self, unit: float) -> None:
        points = np.random.default_rng(1).uniform(size=(300, 3))
        field = np.random.default_rng(2).normal(size=(1, 300, 3))
        free = np.ones((300, 3), dtype=bool)
        expected = Hierarchy(points).numbers(field, 0.1, 1.2, free, 0.6)
        np.testing.assert_array_equal(Hierarchy(unit * points).numbers(field, 0.1, 1.2, free, 0.6), expected)


class TestModes:
    def test_they_are_orthonormal_and_stay_where_nothing_moves(self) -> None:
        space = Space(MESH.points, MESH.tets, ~MESH.on_cube_face)
        for coordinate, modes in enumerate(space.modes(20)):
            np.testing.assert_allclose(modes.T @ modes, np.eye(20), atol=1e-9)
            assert not modes[MESH.on_cube_face[:, coordinate]].any()

    @pytest.mark.parametrize("corners", [3, 4])
    def test_very_large_meshes_have_none(self, corners: int) -> None:
        points, cells = np.zeros((MOST_VERTICES + 1, 3)), np.arange(corners)[None]
        assert [Space(some, cells).most_modes for some in (points[:-1], points)] == [MOST_MODES, 0]

    def test_those_of_large_volumes_are_nearly_the_lowest(self, monkeypatch: pytest.MonkeyPatch) -> None:
        mesh = jittered_grid(11, seed=1)
        field = sine_map(mesh.points, np.full((1, 3), 0.05), np.ones((1, 3, 3), dtype=np.int64)) - mesh.points
        missed = []
        for most in (10**6, 0):
            monkeypatch.setattr(graph_modes_module, "FACTORED_IN_VOLUME", most)
            space = Space(mesh.points, mesh.tets, ~mesh.on_cube_face)
            for coordinate, modes in enumerate(space.modes(12)):
                np.testing.assert_allclose(modes.T @ modes, np.eye(12), atol=1e-9)
                assert not modes[mesh.on_cube_face[:, coordinate]].any()
            again = Space(mesh.points, mesh.tets, ~mesh.on_cube_face)
            np.testing.assert_array_equal(again.modes(12), space.modes(12))
            rest = synthesized(space, analyzed(space, field[None], 12)) - field
            missed.append(np.linalg.norm(rest) / np.linalg.norm(field))
        assert missed[0] <= missed[1] < 1.2 * missed[0] < 0.5

    def test_a_large_volume_around_one_vertex_has_few(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(graph_modes_module, "FACTORED_IN_VOLUME", 0)
        hub = np.stack([np.zeros(700, dtype=np.int64), np.arange(1, 701)], axis=1)
        assert graph_modes(laplacian(hub, 701), np.ones(701, dtype=bool), 8, is_surface=False).shape[1] < 8

    def test_two_equal_parts_have_modes_of_their_own(self) -> None:
        points, faces = icosphere(2)
        both = np.concatenate([faces, faces + len(points)])
        matrix = laplacian(both[:, :2], 2 * len(points))
        modes = graph_modes(matrix, np.ones(2 * len(points), dtype=bool), 2, is_surface=True)
        means = np.abs(modes.reshape(2, len(points), 2).sum(axis=1))
        assert sorted(means.argmax(axis=0).tolist()) == [0, 1]
        assert means.min() < 1e-3 * means.max()

    def test_smooth_fields_need_few(self) -> None:
        space = Space(MESH.points, MESH.tets)
        field = np.sin(2.0 * MESH.points)[None]
        missed = [
            float(np.abs(synthesized(space, analyzed(space, field, count)) - field).mean()) for count in (5, 20, 80)
        ]
        assert missed == sorted(missed, reverse=True)
        assert missed[-1] < 0.2 * missed[0]


@pytest.mark.parametrize(("kind", "option"), [*(("plain", o) for o in range(6)), ("levels", 2), ("modes", 0)])
def test_the_stream_has_all_numbers(kind: str, option: int) -> None:
    space = Space(MESH.points, MESH.tets, ~MESH.on_cube_face)
    shape = (3, 7 if kind == "modes" else len(MESH.points), 3)
    numbers = np.random.default_rng(0).integers(-99, 99, size=shape)
    if kind != "modes":
        numbers *= space.free
    part = Part(kind, option, 0.5, numbers)
    back = Part.of_stream(space, kind, option, 0.5, 3, part.stream(space))
    np.testing.assert_array_equal(back.numbers, numbers)
