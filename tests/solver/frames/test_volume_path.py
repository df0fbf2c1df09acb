# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The map of the cube between the identity and the fitted map, with rotation interpolated."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.frames.volume_path import VolumePath
from qc3d_addon.solver.maps.representation import polar_decomposition
from qc3d_addon.solver.maps.volume_system import VolumeSystem
from qc3d_addon.solver.numerics.rotation_unwrapping import Turning
from qc3d_addon.solver.numerics.rotations import rotation_matrices, rotation_vectors
from qc3d_addon.solver.settings import StretchLaw
from qc3d_addon.solver.tets.mesh import TetMesh
from qc3d_addon.solver.triangles.winding_number import insideness

from ..meshes import jittered_grid, kuhn_grid


def path_of(mesh: TetMesh, values: Floats, inside: Floats, law: StretchLaw = "linear") -> VolumePath:
    turns = rotation_vectors(polar_decomposition(mesh.jacobians(values)).rotation)
    maps = np.stack([mesh.points, values])
    return VolumePath(VolumeSystem(mesh, insideness(inside)), maps, Turning(turns, np.zeros_like(turns)), law)


def whirled(points: Floats, angle: float) -> Floats:
    """The middle of the cube turned as a whole, nothing on its faces, a gradual change between."""
    offsets = points - 0.5
    fading = np.clip((0.45 - np.linalg.norm(offsets, axis=1)) / 0.25, 0.0, 1.0)
    turns = angle * fading[:, None] * np.array([0.0, 0.6, 0.8])
    return np.asarray(0.5 + np.einsum("nij,nj->ni", rotation_matrices(turns), offsets))


@pytest.mark.parametrize("law", ["linear", "logarithmic"])
def test_the_identity_and_the_map_at_the_ends(law: StretchLaw) -> None:
    mesh = jittered_grid(8, seed=1)
    values = whirled(mesh.points, 0.8)
    assert np.linalg.det(mesh.jacobians(values)).min() > 0.0
    inside = np.random.default_rng(0).uniform(0.0, 1.0, len(mesh.tets))
    path = path_of(mesh, values, inside, law)
    np.testing.assert_allclose(path.at(0.0), mesh.points, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(path.at(1.0), values, rtol=0.0, atol=1e-11)
    np.testing.assert_array_equal(path.at(0.4)[mesh.on_cube_face], mesh.points[mesh.on_cube_face])


def test_stretches_along_the_axes_are_interpolated_by_their_law() -> None:
    mesh = kuhn_grid(4)
    values = np.column_stack([mesh.points[:, 0] ** 2, mesh.points[:, 1], np.sqrt(mesh.points[:, 2])])
    everywhere = np.ones(len(mesh.tets))
    linear = path_of(mesh, values, everywhere).at(0.3)
    np.testing.assert_allclose(linear, 0.7 * mesh.points + 0.3 * values, rtol=0.0, atol=1e-12)


def test_what_turns_as_a_whole_inside_keeps_its_shape() -> None:
    mesh = jittered_grid(10, seed=2)
    values = whirled(mesh.points, 1.0)
    core = np.linalg.norm(mesh.points - 0.5, axis=1) < 0.2
    inside = core[mesh.tets].all(axis=1)
    halfway = path_of(mesh, values, inside.astype(np.float64)).at(0.5)
    stretch = polar_decomposition(mesh.jacobians(halfway)[inside]).stretch
    np.testing.assert_allclose(stretch, np.broadcast_to(np.eye(3), stretch.shape), rtol=0.0, atol=0.01)
    np.testing.assert_allclose(halfway[core], whirled(mesh.points, 0.5)[core], rtol=0.0, atol=0.01)


@pytest.mark.parametrize("inside", [-1.0, 2.0])
def test_reversed_and_nested_surfaces_weigh_as_much(inside: float) -> None:
    mesh = jittered_grid(5, seed=3)
    values = whirled(mesh.points, 0.6)
    core = np.where(np.linalg.norm(mesh.centroids - 0.5, axis=1) < 0.25, 1.0, 0.0)
    expected = path_of(mesh, values, core).at(0.4)
    np.testing.assert_allclose(path_of(mesh, values, inside * core).at(0.4), expected, rtol=0.0, atol=1e-12)


def test_nothing_inside() -> None:
    mesh = jittered_grid(5, seed=4)
    values = whirled(mesh.points, 0.6)
    nowhere, everywhere = (path_of(mesh, values, np.full(len(mesh.tets), weight)).at(0.5) for weight in (0.0, 1.0))
    np.testing.assert_allclose(nowhere, everywhere, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("turns", [1, -2])
def test_a_twist_by_whole_turns_ends_where_none_does(turns: int) -> None:
    # The same map, its middle turned on the way by whole turns more; only the way is another.
    mesh = jittered_grid(8, seed=5)
    values = whirled(mesh.points, 0.7)
    core = np.linalg.norm(mesh.centroids - 0.5, axis=1) < 0.2
    rotations = polar_decomposition(mesh.jacobians(values)).rotation
    axis = np.array([0.0, 0.6, 0.8])
    twist = np.where(core[:, None], (0.7 + 2.0 * np.pi * turns) * axis, 0.0)
    swing = rotation_vectors(rotations @ rotation_matrices(-twist))
    maps = np.stack([mesh.points, values])
    system = VolumeSystem(mesh, insideness(core.astype(np.float64)))
    path = VolumePath(system, maps, Turning(swing, twist), "linear")
    np.testing.assert_allclose(path.at(0.0), mesh.points, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(path.at(1.0), values, rtol=0.0, atol=1e-11)
    middle = np.linalg.norm(mesh.points - 0.5, axis=1) < 0.1
    expected = 0.5 + (mesh.points - 0.5) @ rotation_matrices(0.5 * (0.7 + 2.0 * np.pi * turns) * axis[None])[0].T
    np.testing.assert_allclose(path.at(0.5)[middle], expected[middle], rtol=0.0, atol=0.02)


def test_close_times_give_close_maps() -> None:
    mesh = jittered_grid(5, seed=6)
    path = path_of(mesh, whirled(mesh.points, 0.8), np.ones(len(mesh.tets)))
    values = np.stack([path.at(time) for time in np.linspace(0.0, 1.0, 17)])
    steps = np.abs(np.diff(values, axis=0)).max(axis=(1, 2))
    assert steps.max() < 1.5 * steps.mean()
    assert np.abs(np.diff(values, n=2, axis=0)).max() < 2.0 * steps.mean() / 16.0


def test_the_maps_fitted_on_the_way_are_met_and_shared_between() -> None:
    mesh = jittered_grid(6, seed=7)
    values = whirled(mesh.points, 0.8)
    turns = rotation_vectors(polar_decomposition(mesh.jacobians(values)).rotation)
    # Some way that interpolation does not take.
    bump = 0.01 * np.sin(np.pi * mesh.points) * ~mesh.on_cube_face
    maps = np.stack([mesh.points, whirled(mesh.points, 0.3) + bump, whirled(mesh.points, 0.6) - bump, values])
    system = VolumeSystem(mesh, insideness(np.ones(len(mesh.tets))))
    path = VolumePath(system, maps, Turning(turns, np.zeros_like(turns)), "linear")
    for step, fitted in enumerate(maps):
        np.testing.assert_allclose(path.followed(step / 3, path.at(step / 3)), fitted, rtol=0.0, atol=1e-11)
    missed = [fitted - path.at(step / 3) for step, fitted in enumerate(maps)]
    between = path.at(0.5)
    expected = between + 0.5 * (missed[1] + missed[2])
    np.testing.assert_allclose(path.followed(0.5, between), expected, rtol=0.0, atol=1e-12)
