# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The analysis of maps whose distortion is known."""

from __future__ import annotations

import json

import numpy as np

from qc3d_addon.solver.maps.analysis import Analysis
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.maps.representation import from_eigen_form, from_upper_triangle
from qc3d_addon.solver.numerics.rotations import rotation_matrices

from ..meshes import jittered_grid, kuhn_grid, sine_map

AXES = rotation_matrices(np.array([[0.4, -0.7, 0.2]]))[0]
TURN = rotation_matrices(np.array([[-1.0, 0.5, 2.0]]))[0]


def test_an_affine_map() -> None:
    mesh = jittered_grid(3, seed=0)
    stretch = AXES.T @ np.diag([3.0, 2.0, 0.5]) @ AXES
    found = Analysis(Mapping(mesh, mesh.points @ (TURN @ stretch).T + 7.0))
    for matrices in (from_upper_triangle(found.upper_triangle), from_eigen_form(found.eigen_form)):
        np.testing.assert_allclose(matrices, np.broadcast_to(stretch, matrices.shape), atol=1e-10)
    np.testing.assert_allclose(found.eigenvalues, np.tile([3.0, 2.0, 0.5], (len(mesh.tets), 1)), atol=1e-10)
    np.testing.assert_allclose(np.abs(found.directions @ AXES.T), np.tile(np.eye(3), (len(mesh.tets), 1, 1)), atol=1e-9)
    expected = {"dilatation": 6.0, "outer_dilatation": 9.0, "inner_dilatation": 24.0, "volume_ratio": 3.0}
    for name, value in expected.items():
        np.testing.assert_allclose(found.measures[name], value, rtol=1e-9)
        np.testing.assert_allclose(found.at_vertices()[name], value, rtol=1e-9)
        for statistic in found.summary()[name].values():
            np.testing.assert_allclose(statistic, value, rtol=1e-9)
    np.testing.assert_allclose(found.summary()["volume"]["target"], 3.0, rtol=1e-10)


def test_a_map_of_the_cube_onto_itself_keeps_its_volume() -> None:
    mesh = jittered_grid(5, seed=1)
    values = sine_map(mesh.points, np.array([[0.05, -0.04, 0.03]]), np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]]]))
    summary = Analysis(Mapping(mesh, values)).summary()
    assert summary["folds"] == 0
    np.testing.assert_allclose([summary["volume"]["source"], summary["volume"]["target"]], 1.0, atol=1e-12)
    np.testing.assert_allclose(summary["volume_ratio"]["mean"], 1.0, atol=1e-12)
    ordered = [summary["dilatation"][name] for name in ("smallest", "median", "percentile_99", "largest")]
    assert ordered == sorted(ordered)
    assert 1.0 <= ordered[0] < ordered[-1]


def test_folds_are_counted_and_no_number_is_infinite_in_a_file() -> None:
    mesh = kuhn_grid(2)
    values = mesh.points.copy()
    values[(mesh.points == 0.5).all(axis=1)] = [1.5, 0.5, 0.5]
    found = Analysis(Mapping(mesh, values))
    summary = json.loads(json.dumps(found.summary(), allow_nan=False))
    assert summary["folds"] == (np.linalg.det(found.mapping.jacobians) <= 0.0).sum() > 0
    assert summary["dilatation"]["largest"] is None
    assert summary["volume_ratio"]["smallest"] < 0.0
    np.testing.assert_allclose(summary["volume"]["target"], 1.0, atol=1e-12)
