# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tetrahedra as fine as a surface's own edges."""

from __future__ import annotations

import numpy as np

from qc3d_addon.solver.meshing.cube import require_filled_cube
from qc3d_addon.solver.meshing.vertex_mesh import size_around, vertex_mesh
from qc3d_addon.solver.tets.point_location import locate

from ..meshes import icosphere


def test_it_fills_the_cube_and_repeats() -> None:
    first, second = (vertex_mesh(*icosphere(2, 0.2), seed=4) for _ in range(2))
    require_filled_cube(first)
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.tets, second.tets)


def test_few_vertices_share_a_tetrahedron() -> None:
    points, faces = icosphere(3, 0.25)
    tets, _ = locate(vertex_mesh(points, faces, seed=0), points)
    assert len(np.unique(tets)) > 0.9 * len(points)


def test_it_is_finer_where_the_surface_is_stretched() -> None:
    points, faces = icosphere(4, 0.25)
    middle = points.mean(axis=0)
    upper = points[:, 2] > middle[2]
    moved = points + np.where(upper, 8.0 * (points[:, 2] - middle[2]), 0.0)[:, None] * [0.0, 0.0, 1.0]
    mesh = vertex_mesh(points, faces, 0, moved)
    near = mesh.centroids[np.abs(np.linalg.norm(mesh.centroids - middle, axis=1) - 0.25) < 0.05]
    above = np.count_nonzero(near[:, 2] > middle[2] + 0.05)
    below = np.count_nonzero(near[:, 2] < middle[2] - 0.05)
    assert above > 2 * below


def test_it_is_finer_where_edges_are_short_and_across_gaps() -> None:
    ticks = np.linspace(0.2, 0.8, 31)
    sheet = np.stack(np.meshgrid(ticks, ticks, [0.5], indexing="ij"), axis=-1).reshape(-1, 3)
    size = size_around(np.concatenate([sheet, sheet[:1] + [0.0, 0.0, 0.001]]), np.ones(len(sheet) + 1))
    beside, elsewhere = size(np.array([[0.2, 0.2, 0.5], [0.6, 0.6, 0.5]]))
    assert 0.01 < elsewhere < 0.02
    assert beside < 0.002


def test_points_that_coincide_and_single_points() -> None:
    for points in (np.full((40, 3), 0.5), np.array([[0.4, 0.5, 0.6]])):
        require_filled_cube(vertex_mesh(points, np.empty((0, 3), dtype=np.int64), seed=0))
