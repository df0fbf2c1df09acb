# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The linear system of a surface's moving vertices against dense formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from qc3d_addon.solver.arrays import Bools, Floats, Ints
from qc3d_addon.solver.numerics.nested_dissection import factored
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.surface import system
from qc3d_addon.solver.surface.sweeps import Sweeps, Wanted
from qc3d_addon.solver.surface.system import MovingSurface
from qc3d_addon.solver.triangles.closed_volume import ClosedComponents
from qc3d_addon.solver.triangles.deformation import TriangleDeformation

from ..meshes import bent, box_surface

POINTS, FACES = box_surface((2, 2, 5), (1.0, 1.0, 3.0))
SPRINGS = np.array([[0, 17], [3, 30], [5, 6]])
COUNT = len(POINTS)


def free_vertices(seed: int) -> Bools:
    return np.random.default_rng(seed).random(COUNT) < 0.7


def surface_of(free: Bools, anchor_weights: Floats, springs: Ints = SPRINGS) -> MovingSurface:
    deformation = TriangleDeformation.between(POINTS, POINTS, FACES)
    closed = ClosedComponents(FACES, np.zeros(COUNT, dtype=np.int64))
    covering = FACES, np.ones(len(FACES))
    return MovingSurface(deformation, springs, closed, covering, free, POINTS, anchor_weights)


def dense_stiffness() -> Floats:
    """(n, n) of the weighted triangles, with each gradient from the pseudo-inverse of the triangle's edges."""
    weights = TriangleDeformation.between(POINTS, POINTS, FACES).weights
    stiffness = np.zeros((COUNT, COUNT))
    for corners, weight in zip(FACES, weights, strict=True):
        # Values at the corners -> differences along two edges -> the gradient in the triangle's plane.
        differences = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
        gradient = np.linalg.pinv(differences @ POINTS[corners]) @ differences
        stiffness[np.ix_(corners, corners)] += weight * gradient.T @ gradient
    for first, second in SPRINGS:
        stiffness[[first, second], [first, second]] += 1.0
        stiffness[[first, second], [second, first]] -= 1.0
    return stiffness


@pytest.mark.parametrize("seed", [0, 1])
def test_it_solves_the_dense_system(seed: int) -> None:
    random = np.random.default_rng(seed)
    free, anchor_weights = free_vertices(seed), random.uniform(0.1, 2.0, COUNT)
    surface = surface_of(free, anchor_weights)
    matrix = dense_stiffness()[np.ix_(surface.moving, surface.moving)] + np.diag(anchor_weights[surface.moving])
    loads = random.normal(size=(3, 2, len(surface.moving)))
    assert np.abs(surface.solve(loads) @ matrix - loads).max() < 1e-11
    assert sorted(surface.moving) == np.flatnonzero(free).tolist()


def test_what_rests_enters_through_its_neighbors() -> None:
    free = free_vertices(2)
    surface = surface_of(free, np.ones(COUNT))
    values = np.random.default_rng(2).normal(size=COUNT)
    resting = surface.used[len(surface.moving) :]
    wanted = dense_stiffness()[np.ix_(surface.moving, np.flatnonzero(~free))] @ values[~free]
    assert not free[resting].any()
    assert np.abs(surface.stiffness_beside(np.tile(values[resting], (3, 1))) - wanted).max() < 1e-12


def test_other_anchor_weights_are_as_if_built_anew() -> None:
    free, loads = free_vertices(3), np.random.default_rng(3).normal(size=(1, int(free_vertices(3).sum())))
    changed = surface_of(free, np.ones(COUNT)).with_anchor_weights(np.linspace(1.0, 5.0, COUNT))
    assert np.array_equal(changed.solve(loads), surface_of(free, np.linspace(1.0, 5.0, COUNT)).solve(loads))


def test_factors_that_were_given_up_are_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = surface_of(free_vertices(3), np.ones(COUNT))
    loads = np.random.default_rng(3).normal(size=(1, len(surface.moving)))
    before = surface.solve(loads)
    made: list[csr_array] = []
    monkeypatch.setattr(system, "factored", lambda matrix: made.append(matrix) or factored(matrix))
    surface.release()
    surface.solve(loads)
    assert not made  # small ones are kept
    monkeypatch.setattr(system, "_MANY", 1)
    surface.release()
    np.testing.assert_array_equal(surface.solve(loads), before)
    surface.solve(loads)
    assert len(made) == 1


def test_gradients_of_a_linear_function_are_its_slopes() -> None:
    surface = surface_of(free_vertices(4), np.ones(COUNT))
    slope = np.array([1.0, -2.0, 0.5])
    (piece,) = surface.pieces
    found = (piece.gradient @ (POINTS @ slope)[surface.used]).reshape(2, -1)
    bases = TriangleDeformation.between(POINTS, POINTS, FACES).bases[surface.rows]
    assert np.abs(found - np.einsum("mcd,c->dm", bases[:, :, :2], slope)).max() < 1e-12


@pytest.mark.parametrize("sweeps", [1, 6])
def test_a_rigid_motion_of_the_wanted_is_met(sweeps: int) -> None:
    surface = surface_of(np.ones(COUNT, dtype=bool), np.ones(COUNT))
    rotation = rotation_matrices(np.array([[0.4, -1.1, 0.3]]))[0]
    goal = POINTS @ rotation.T + [0.1, 0.2, -0.3]
    deformation = TriangleDeformation.between(POINTS, POINTS, FACES)
    volume = ClosedComponents(FACES, np.zeros(COUNT, dtype=np.int64)).volumes(POINTS)
    stretch = np.broadcast_to(np.eye(2), (len(FACES), 2, 2))
    lengths = np.linalg.norm(POINTS[SPRINGS[:, 0]] - POINTS[SPRINGS[:, 1]], axis=1)
    tangents = np.einsum("ij,mjd->idm", rotation, deformation.bases[surface.rows][:, :, :2])
    start = bent(POINTS, 0.2) @ rotation.T
    wanted = Wanted(start, tangents, stretch, goal, lengths, volume)
    settled = Sweeps(surface, [wanted]).settled(60)[0]
    assert np.abs(settled - goal).max() < 1e-6
    started_there = Sweeps(surface, [Wanted(goal, tangents, stretch, goal, lengths, volume)]).settled(sweeps)[0]
    assert np.abs(started_there - goal).max() < 1e-12


def test_what_rests_stays_bit_for_bit() -> None:
    free = free_vertices(5)
    surface = surface_of(free, np.full(COUNT, 1e-3))
    deformation = TriangleDeformation.between(POINTS, POINTS, FACES)
    goal = bent(POINTS, 0.5)
    wanted = Wanted(
        np.where(free[:, None], goal, POINTS),
        deformation.bases[surface.rows][:, :, :2].transpose(1, 2, 0),
        np.broadcast_to(np.eye(2), (len(surface.rows), 2, 2)),
        goal,
        np.ones(len(surface.springs)),
        ClosedComponents(FACES, np.zeros(COUNT, dtype=np.int64)).volumes(POINTS),
    )
    settled = Sweeps(surface, [wanted]).settled(8)[0]
    assert np.array_equal(settled[~free], POINTS[~free])
    assert np.abs(settled[free] - goal[free]).max() > 1e-3
