# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps between the identity and a map, where the exact result is known."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.frames.linear import LinearMaps
from qc3d_addon.solver.maps.representation import polar_decomposition
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import jittered_grid, kuhn_grid, sine_map

WAVES = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]]])


def test_the_identity_and_the_map_at_the_ends(mesh: TetMesh) -> None:
    values = mesh.points
    for size in (0.06, 0.02, 0.005):
        bent = sine_map(mesh.points, np.full((1, 3), size), WAVES)
        if np.linalg.det(mesh.jacobians(bent)).min() > 0.0:
            values = bent
            break
    assert np.abs(values - mesh.points).max() > 0.001
    maps = LinearMaps(mesh, values)
    np.testing.assert_allclose(maps.at(0.0), mesh.points, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(maps.at(1.0), values, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("time", [0.2, 0.5, 0.9])
def test_stretches_along_the_axes_are_blended(time: float) -> None:
    # Every coordinate by its own function of itself, on a grid: all interpolated stretches fit together exactly.
    mesh = kuhn_grid(5)
    values = np.column_stack([mesh.points[:, 0] ** 2, np.sqrt(mesh.points[:, 1]), mesh.points[:, 2]])
    expected = (1.0 - time) * mesh.points + time * values
    np.testing.assert_allclose(LinearMaps(mesh, values).at(time), expected, rtol=0.0, atol=1e-10)


def quasiconformal_defect(mesh: TetMesh, values: Floats, stretch: Floats) -> float:
    """How far the stretches of a map are from given ones."""
    return float(np.abs(polar_decomposition(mesh.jacobians(values)).stretch - stretch).max())


def test_the_boundary_slides_at_all_times() -> None:
    mesh = jittered_grid(5, seed=3)
    values = sine_map(mesh.points, np.full((1, 3), 0.07), WAVES)
    assert np.linalg.det(mesh.jacobians(values)).min() > 0.0
    maps = LinearMaps(mesh, values)
    for time in (0.3, 0.7):
        found = maps.at(time)
        np.testing.assert_array_equal(found[mesh.on_cube_face], mesh.points[mesh.on_cube_face])
        # The interpolated stretches do not quite fit together: the rebuilt map comes close to them.
        wanted = (1.0 - time) * np.eye(3) + time * polar_decomposition(mesh.jacobians(values)).stretch
        assert quasiconformal_defect(mesh, found, wanted) < 0.15
        assert np.linalg.det(mesh.jacobians(found)).min() > 0.0
