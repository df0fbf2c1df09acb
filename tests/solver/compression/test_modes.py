# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Modes of a mesh, and the transfer between tetrahedra and vertices."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.compression.modes import Transfer, spectrum
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.numerics.assembly import StiffnessPattern, stiffness_elements

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


@pytest.mark.parametrize("count", [0, 124, 1000])
def test_too_many_modes(count: int) -> None:
    with pytest.raises(InputError, match=f"{count} modes are not possible on 125 vertices; choose 1 to 123"):
        spectrum(jittered_grid(4, seed=0), count)


def test_transfers_keep_constants_and_integrals() -> None:
    mesh = jittered_grid(3, seed=2)
    transfer = Transfer(mesh)
    values = np.random.default_rng(0).normal(size=len(mesh.tets))
    np.testing.assert_allclose(transfer.to_vertices @ np.ones(len(mesh.tets)), 1.0, atol=1e-14)
    np.testing.assert_allclose(transfer.to_tets @ np.ones(len(mesh.points)), 1.0, atol=1e-14)
    np.testing.assert_allclose(transfer.vertex_volumes @ (transfer.to_vertices @ values), mesh.volumes @ values)
    np.testing.assert_allclose(transfer.to_tets @ mesh.points, mesh.centroids, atol=1e-15)
