# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Modes of a mesh, and the transfer between tetrahedra and vertices."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.compression import modes
from qc3d_addon.solver.compression.modes import Transfer, spectrum
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.numerics.assembly import StiffnessPattern, stiffness_elements
from qc3d_addon.solver.support import memory
from qc3d_addon.solver.tets.kuhn_grid import uneven_grid
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import jittered_grid, kuhn_grid


def test_modes_solve_their_equation() -> None:
    mesh = jittered_grid(5, seed=0)
    found = spectrum(mesh, 20)
    stiffness = StiffnessPattern(mesh.tets, len(mesh.points)).assemble(stiffness_elements(mesh.volumes, mesh.gradients))
    mass = Transfer(mesh).vertex_volumes
    np.testing.assert_allclose(found.modes.T @ (mass[:, None] * found.modes), np.eye(20), atol=1e-10)
    np.testing.assert_allclose(stiffness @ found.modes, mass[:, None] * found.modes * found.eigenvalues, atol=1e-9)
    assert (np.diff(found.eigenvalues) >= 0.0).all()
    np.testing.assert_allclose(found.eigenvalues[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(found.modes[:, 0]), 1.0, atol=1e-9)  # the cube's volume is 1


def test_the_lowest_frequencies_of_the_cube() -> None:
    values = spectrum(kuhn_grid(10), 5).eigenvalues
    np.testing.assert_allclose(values[1:4], np.pi**2, rtol=0.03)


def test_the_same_every_time() -> None:
    mesh = jittered_grid(4, seed=1)
    first, second = spectrum(mesh, 15), spectrum(mesh, 15)
    np.testing.assert_array_equal(first.modes, second.modes)
    np.testing.assert_allclose(spectrum(mesh, 30).modes[:, :10], first.modes[:, :10], atol=1e-8)


@pytest.mark.parametrize("count", [0, 126, 1000])
def test_too_many_modes(count: int) -> None:
    with pytest.raises(InputError, match=f"{count} modes are not possible on 125 vertices; choose 1 to 125"):
        spectrum(jittered_grid(4, seed=0), count)


def test_all_modes_are_a_basis() -> None:
    mesh = jittered_grid(4, seed=3)
    found, few = spectrum(mesh, 125), spectrum(mesh, 20)
    np.testing.assert_allclose(found.modes[:, :20], few.modes, atol=1e-8)
    values = np.random.default_rng(0).normal(size=125)
    coefficients = found.modes.T @ (Transfer(mesh).vertex_volumes * values)
    np.testing.assert_allclose(found.modes @ coefficients, values, atol=1e-10)


def test_transfers_keep_constants_and_integrals() -> None:
    mesh = jittered_grid(3, seed=2)
    transfer = Transfer(mesh)
    values = np.random.default_rng(0).normal(size=len(mesh.tets))
    np.testing.assert_allclose(transfer.to_vertices @ np.ones(len(mesh.tets)), 1.0, atol=1e-14)
    np.testing.assert_allclose(transfer.to_tets @ np.ones(len(mesh.points)), 1.0, atol=1e-14)
    np.testing.assert_allclose(transfer.vertex_volumes @ (transfer.to_vertices @ values), mesh.volumes @ values)
    np.testing.assert_allclose(transfer.to_tets @ mesh.points, mesh.centroids, atol=1e-15)


@pytest.mark.parametrize("weights", ["volume", "equal"])
@pytest.mark.parametrize("grading", [0.0, 0.9])
def test_large_meshes_have_the_modes_that_a_factored_matrix_gives(
    weights: modes.Weights, grading: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    grid = uneven_grid(14)
    # Graded: cells at the faces up to 19 times as wide as those in the middle.
    mesh = TetMesh(grid.points + grading / (2.0 * np.pi) * np.sin(2.0 * np.pi * grid.points), grid.tets)
    factored = spectrum(mesh, 30, weights)
    monkeypatch.setattr(modes, "_FEW", 0)
    monkeypatch.setattr(modes, "_factored", None)
    found = spectrum(mesh, 30, weights)
    np.testing.assert_allclose(found.eigenvalues, factored.eigenvalues, atol=1e-10 * factored.eigenvalues[-1])
    np.testing.assert_allclose(found.modes, factored.modes, atol=1e-5)
    np.testing.assert_array_equal(spectrum(mesh, 30, weights).modes, found.modes)


def test_more_modes_than_are_worked_on_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = uneven_grid(16)
    monkeypatch.setattr(modes, "_FEW", 0)
    monkeypatch.setattr("qc3d_addon.solver.numerics.lowest_eigenvectors.BLOCK", 24)
    found = spectrum(mesh, 40)
    mass = Transfer(mesh).vertex_volumes
    np.testing.assert_allclose(found.modes.T @ (mass[:, None] * found.modes), np.eye(40), atol=1e-10)
    # An element matrix is v G G^T: the Rayleigh quotient of a mode is the integral of its squared gradient.
    gradients = np.einsum("mka,mkj->maj", mesh.gradients, found.modes[mesh.tets])
    np.testing.assert_allclose(np.einsum("m,maj->j", mesh.volumes, gradients**2), found.eigenvalues, atol=1e-9)
    monkeypatch.setattr(modes, "_FEW", 10**9)
    np.testing.assert_allclose(found.eigenvalues, spectrum(mesh, 40).eigenvalues, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("few", [0, 10**9])
def test_two_parts_and_a_vertex_of_no_tetrahedron(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modes, "_FEW", few)
    part, alone = uneven_grid(10), np.array([[9.0, 9.0, 9.0]])
    points = np.concatenate([part.points, alone, 0.5 * part.points + 4.0])
    mesh = TetMesh(points, np.concatenate([part.tets, part.tets + len(part.points) + 1]))
    found = spectrum(mesh, 12)
    np.testing.assert_allclose(found.eigenvalues[:2], 0.0, atol=1e-9)
    assert found.eigenvalues[2] > 1.0
    assert not found.modes[len(part.points)].any()
    expected = np.sort([*spectrum(part, 12).eigenvalues, *4.0 * spectrum(part, 12).eigenvalues])[:12]
    np.testing.assert_allclose(found.eigenvalues, expected, rtol=1e-8, atol=1e-8)


def test_memory_is_asked_for_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "machine_limit_mb", lambda: 160)
    spectrum(jittered_grid(4, seed=0), 10)
    with pytest.raises(InputError, match=r"Computing 80 modes of 12167 vertices needs about 2\d\d MB of memory"):
        spectrum(uneven_grid(22), 80)
