# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps from arrays of any origin, and custom boundary conditions for their reconstruction."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.errors import InputError, ReconstructionError
from qc3d_addon.solver.maps.boundary_conditions import Conditions
from qc3d_addon.solver.maps.mapping import Mapping, checked_mesh
from qc3d_addon.solver.maps.reconstruction import reconstruct
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import jittered_grid, kuhn_grid, sine_map

EXACT = 1e-10
WAVES = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]]])


def ball(count: int = 150, seed: int = 0) -> TetMesh:
    """The Delaunay tetrahedra of points in a ball, without those that are nearly flat on its surface."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(count, 3))
    points *= (random.uniform(size=count) ** (1 / 3) / np.linalg.norm(points, axis=1))[:, None]
    return checked_mesh(points, Delaunay(points).simplices)


def bend(points: Floats) -> Floats:
    x, y, z = points.T
    return np.column_stack([x + 0.02 * z**2, 1.2 * y - 0.02 * x * z, 0.9 * z + 0.01 * np.sin(2.0 * y)])


class TestMapping:
    @pytest.mark.parametrize(("size", "said"), [(1.2e-309, "flat"), (1e-200, "flat"), (1e200, "beyond 1e\\+75")])
    def test_sizes_that_numbers_cannot_hold(self, size: float, said: str) -> None:
        points = [[0.0, 0.0, 0.0], [size, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        with np.errstate(all="raise", under="ignore"), pytest.raises(InputError, match=said):
            checked_mesh(points, [[0, 1, 2, 3]])

    @pytest.mark.parametrize("points", [np.zeros((4, 3), dtype=complex), [["a", "b", "c"]] * 4, np.zeros((4, 3), bool)])
    def test_what_is_no_coordinate(self, points: object) -> None:
        with pytest.raises(InputError, match="must be numbers"):
            checked_mesh(points, [[0, 1, 2, 3]])  # type: ignore[arg-type]

    def test_tetrahedra_are_turned_the_right_way_round(self) -> None:
        mesh = kuhn_grid(2)
        tets = mesh.tets.copy()
        tets[::3] = tets[::3][:, [1, 0, 2, 3]]
        found = Mapping.checked(mesh.points, tets, 2.0 * mesh.points)
        assert found.mesh.volumes.min() > 0.0
        np.testing.assert_allclose(found.stretch, np.tile(2.0 * np.eye(3), (len(tets), 1, 1)), atol=1e-14)
        assert found.folds == 0

    def test_folds_are_counted(self) -> None:
        mesh = kuhn_grid(2)
        middle = np.flatnonzero((mesh.points == 0.5).all(axis=1))
        values = mesh.points.copy()
        values[middle] = [1.5, 0.5, 0.5]
        found = Mapping.checked(mesh.points, mesh.tets, values)
        assert found.folds == (np.linalg.det(found.jacobians) <= 0.0).sum() > 0
        assert Mapping.checked(mesh.points, mesh.tets, -mesh.points).folds == len(mesh.tets)

    @pytest.mark.parametrize(
        ("points", "tets", "values", "sentence"),
        [
            (np.eye(3), [[0, 1, 2, 0]], np.eye(3), "flat"),
            (np.zeros((4, 2)), [[0, 1, 2, 3]], np.zeros((4, 3)), r"shape \(4, 2\)"),
            (np.zeros((4, 3)), [[0, 1, 2, 4]], np.zeros((4, 3)), "no vertex"),
            (np.zeros((4, 3)), [[0.0, 1.0, 2.0, 3.0]], np.zeros((4, 3)), "no tetrahedra"),
            (np.zeros((4, 3)), np.empty((0, 4), dtype=int), np.zeros((4, 3)), "no tetrahedra"),
            (kuhn_grid(1).points, kuhn_grid(1).tets, np.zeros((3, 3)), "3 images for 8 vertices"),
            (kuhn_grid(1).points, kuhn_grid(1).tets, np.full((8, 3), np.nan), "not finite"),
            (kuhn_grid(1).points, kuhn_grid(1).tets, [["a"]], "must be numbers"),
        ],
    )
    def test_arrays_that_are_no_map(self, points: object, tets: object, values: object, sentence: str) -> None:
        with pytest.raises(InputError, match=sentence):
            Mapping.checked(points, tets, values)  # type: ignore[arg-type]


class TestReconstruct:
    def test_any_mesh_whose_boundary_is_held(self) -> None:
        mesh = ball()
        wanted = Mapping(mesh, bend(mesh.points))
        assert wanted.folds == 0
        conditions = Conditions.fixed_boundary(mesh, wanted.values)
        assert not conditions.held.all()
        found = reconstruct(mesh, wanted.stretch, conditions)
        assert np.abs(found.values - wanted.values).max() < EXACT

    def test_the_sliding_cube(self) -> None:
        mesh = jittered_grid(4, seed=1)
        wanted = Mapping(mesh, sine_map(mesh.points, np.array([[0.05, -0.04, 0.03]]), WAVES))
        found = reconstruct(mesh, wanted.stretch, Conditions.sliding_cube(mesh))
        assert np.abs(found.values - wanted.values).max() < EXACT

    def test_one_coordinate_of_a_landmark(self) -> None:
        mesh = jittered_grid(4, seed=2)
        inside = np.flatnonzero(~mesh.on_cube_face.any(axis=1))[[4]]
        conditions = Conditions.sliding_cube(mesh).with_landmarks(inside, [[np.nan, 0.6, np.nan]])
        found = reconstruct(mesh, np.tile(np.eye(3), (len(mesh.tets), 1, 1)), conditions).values
        assert found[inside, 1] == 0.6
        # The three coordinates do not know of each other.
        np.testing.assert_allclose(found[:, [0, 2]], mesh.points[:, [0, 2]], atol=EXACT)
        assert np.abs(found[:, 1] - mesh.points[:, 1]).max() > 0.01

    def test_vertices_of_no_tetrahedron_stay(self) -> None:
        cube = jittered_grid(3, seed=3)
        mesh = TetMesh(np.concatenate([cube.points, [[0.3, 0.4, 0.9]]]), cube.tets)
        wanted = sine_map(mesh.points, np.array([[0.05, -0.04, 0.03]]), WAVES)
        found = reconstruct(mesh, Mapping(mesh, wanted).stretch, Conditions.sliding_cube(mesh))
        assert np.abs(found.values - wanted)[:-1].max() < EXACT
        np.testing.assert_array_equal(found.values[-1], mesh.points[-1])

    def test_a_representation_of_another_size(self) -> None:
        mesh = kuhn_grid(2)
        with pytest.raises(ReconstructionError, match=r"shape \(5, 3, 3\).*48 tetrahedra"):
            reconstruct(mesh, np.tile(np.eye(3), (5, 1, 1)), Conditions.sliding_cube(mesh))

    @pytest.mark.parametrize("entry", [0.3, np.nan])
    def test_a_representation_that_is_not_symmetric(self, entry: float) -> None:
        mesh = kuhn_grid(2)
        stretch = np.tile(np.eye(3), (len(mesh.tets), 1, 1))
        stretch[3, 0, 2] = entry
        with pytest.raises(ReconstructionError, match="not symmetric, or not finite"):
            reconstruct(mesh, stretch, Conditions.sliding_cube(mesh))


class TestConditions:
    def test_a_mesh_that_is_no_cube_cannot_slide(self) -> None:
        with pytest.raises(ReconstructionError, match="does not fill the unit cube"):
            Conditions.sliding_cube(ball())

    def test_nothing_is_held(self) -> None:
        mesh = ball()
        with pytest.raises(ReconstructionError, match="coordinate x of the map is held nowhere"):
            Conditions.none(mesh).require_enough(mesh)

    def test_one_coordinate_is_held_nowhere(self) -> None:
        mesh = ball()
        both = Conditions.none(mesh).with_landmarks([0, 1], [[0.0, 0.0, np.nan], [1.0, 1.0, np.nan]])
        with pytest.raises(ReconstructionError, match="coordinate z of the map is held nowhere"):
            both.require_enough(mesh)

    def test_one_part_is_not_held(self) -> None:
        one = kuhn_grid(1)
        two = TetMesh(np.concatenate([one.points, one.points + 5.0]), np.concatenate([one.tets, one.tets + 8]))
        first = Conditions.none(two).with_landmarks(np.arange(8), two.points[:8])
        with pytest.raises(ReconstructionError, match="nowhere on 1 of the mesh's 2 parts"):
            first.require_enough(two)
        first.with_landmarks([8, 15], two.points[[8, 15]]).require_enough(two)

    def test_one_value_makes_a_flat_map(self) -> None:
        mesh = ball()
        same = Conditions.none(mesh).with_landmarks([0, 1], [[0.0, 0.0, 2.0], [1.0, 1.0, 2.0]])
        with pytest.raises(ReconstructionError, match="coordinate z of the map has one value"):
            same.require_enough(mesh)

    @pytest.mark.parametrize(
        ("vertices", "values", "sentence"),
        [
            ([0, 0], np.zeros((2, 3)), "twice"),
            ([-1], np.zeros((1, 3)), "no vertex"),
            ([500], np.zeros((1, 3)), "no vertex"),
            ([0], np.zeros((2, 3)), "list of vertex numbers"),
            ([0], np.full((1, 3), np.inf), "infinite"),
        ],
    )
    def test_landmarks_that_are_none(self, vertices: list[int], values: Floats, sentence: str) -> None:
        with pytest.raises(InputError, match=sentence):
            Conditions.none(ball()).with_landmarks(vertices, values)
