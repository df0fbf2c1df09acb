# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sparse assembly against dense sums, and the stiffness matrix on functions with known energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from qc3d_addon.solver.arrays import Ints
from qc3d_addon.solver.numerics import assembly
from qc3d_addon.solver.numerics.assembly import PerCoordinate, StiffnessPattern, repeated, stiffness_elements
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import icosphere, jittered_grid

MESH = jittered_grid(3, seed=1)


@pytest.mark.parametrize("elements", [MESH.tets, icosphere(1)[1], np.array([[3, 0], [0, 5]]), np.empty((0, 3), int)])
def test_assembly_against_dense_sums(elements: Ints) -> None:
    count, corners = int(elements.max(initial=5)) + 2, elements.shape[1]
    values = np.random.default_rng(0).normal(size=(len(elements), corners, corners))
    expected = np.zeros((count, count))
    np.add.at(expected, (elements[:, :, None], elements[:, None, :]), values)
    pattern = StiffnessPattern(elements, count)
    np.testing.assert_allclose(pattern.assemble(values).toarray(), expected, rtol=0.0, atol=1e-14)
    # The pattern keeps nothing of the values.
    np.testing.assert_allclose(pattern.assemble(2.0 * values).toarray(), 2.0 * expected, rtol=0.0, atol=1e-13)


def test_block_assembly_against_dense_sums() -> None:
    elements, count = MESH.tets, len(MESH.points)
    values = np.random.default_rng(0).normal(size=(len(elements), 4, 4, 3, 3))
    expected = np.zeros((count, count, 3, 3))
    np.add.at(expected, (elements[:, :, None], elements[:, None, :]), values)
    found = StiffnessPattern(elements, count).assemble_blocks(values)
    dense = expected.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count)
    np.testing.assert_allclose(found.toarray(), dense, rtol=0.0, atol=1e-13)


def test_jacobians_of_linear_maps_and_their_transpose() -> None:
    random = np.random.default_rng(0)
    linear, fields = random.normal(size=(3, 3)), random.normal(size=(len(MESH.tets), 3, 3))
    everywhere = np.broadcast_to(linear, (len(MESH.tets), 3, 3))
    np.testing.assert_allclose(MESH.jacobians(MESH.points @ linear.T + 0.3), everywhere, rtol=0.0, atol=1e-12)
    expected = np.zeros(MESH.points.shape)
    np.add.at(expected, MESH.tets, MESH.gradients @ fields.transpose(0, 2, 1))
    np.testing.assert_allclose(MESH.divergence(fields), expected, rtol=0.0, atol=1e-11)


def energy_matrix(mesh: TetMesh, conductivity: np.ndarray) -> np.ndarray:
    everywhere = np.broadcast_to(conductivity, (len(mesh.tets), 3, 3))
    elements = stiffness_elements(mesh.volumes, mesh.gradients, everywhere)
    return StiffnessPattern(mesh.tets, len(mesh.points)).assemble(elements).toarray()


def test_linear_functions_have_their_exact_energy(mesh: TetMesh) -> None:
    conductivity = np.array([[3.0, 0.5, -0.2], [0.5, 2.0, 0.1], [-0.2, 0.1, 1.0]])
    everywhere = np.broadcast_to(conductivity, (len(mesh.tets), 3, 3))
    elements = stiffness_elements(mesh.volumes, mesh.gradients, everywhere)
    matrix = StiffnessPattern(mesh.tets, len(mesh.points)).assemble(elements)
    np.testing.assert_allclose(mesh.points.T @ (matrix @ mesh.points), conductivity, rtol=0.0, atol=1e-11)
    forces = matrix @ mesh.points
    inside = ~mesh.on_cube_face.any(axis=1)
    assert np.abs(forces[inside]).max() < 1e-12
    assert np.abs(matrix @ np.ones(len(mesh.points))).max() < 1e-12


def test_symmetric_and_positive_up_to_constants() -> None:
    matrix = energy_matrix(MESH, np.diag([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(matrix, matrix.T, rtol=0.0, atol=1e-15)
    eigenvalues = np.linalg.eigvalsh(matrix)
    assert abs(eigenvalues[0]) < 1e-14
    assert eigenvalues[1] > 1e-3


def test_without_a_conductivity_it_is_the_identity() -> None:
    plain = stiffness_elements(MESH.volumes, MESH.gradients)
    identity = stiffness_elements(MESH.volumes, MESH.gradients, np.broadcast_to(np.eye(3), (len(MESH.tets), 3, 3)))
    np.testing.assert_allclose(plain, identity, rtol=0.0, atol=1e-15)


def test_triangles_have_the_cotangent_laplacian() -> None:
    # A right triangle with legs 1: cotangents 0, 1, 1.
    gradients = np.array([[[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]])
    expected = [[1.0, -0.5, -0.5], [-0.5, 0.5, 0.0], [-0.5, 0.0, 0.5]]
    np.testing.assert_allclose(stiffness_elements(np.array([0.5]), gradients)[0], expected, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("few", [0, 10**6])
@pytest.mark.parametrize("shape", [(3, 5), (3, 2, 5)])
def test_a_matrix_for_each_coordinate(few: int, shape: tuple[int, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assembly, "_FEW_ENTRIES", few)
    random = np.random.default_rng(1)
    dense = random.normal(size=(4, 5)) * (random.random((4, 5)) < 0.5)
    values, loads = random.normal(size=shape), random.normal(size=(*shape[:-1], 4))
    matrix = PerCoordinate(csr_array(dense))
    np.testing.assert_allclose(matrix(values), values @ dense.T, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(matrix.transposed(loads), loads @ dense, rtol=0.0, atol=1e-14)


def test_blocks_along_the_diagonal() -> None:
    dense = np.array([[1.0, 0.0, 2.0], [0.0, 0.0, 3.0]])
    twice = repeated(csr_array(dense), 2).toarray()
    np.testing.assert_array_equal(twice, np.kron(np.eye(2), dense))
    other = repeated(csr_array(dense), 2, np.arange(6.0)).toarray()
    assert other[3, 5] == 5.0
    assert other[0, 0] == 0.0
