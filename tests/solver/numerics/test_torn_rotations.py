# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folds around which rotations add up to a full turn: their branches are those of the surroundings."""

from __future__ import annotations

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.numerics.rotation_forest import RotationForest
from qc3d_addon.solver.numerics.rotations import nearest_branch, rotation_matrices
from qc3d_addon.solver.numerics.torn_rotations import closed_tears

from ..meshes import box_surface

SIDES, RINGS = 16, 32


def grid_of_turns(angles: Floats) -> tuple[Floats, Ints]:
    """Rotation vectors about z, and the neighbors, of a grid of angles (rows, columns) in degrees."""
    numbers = np.arange(angles.size).reshape(angles.shape)
    across = np.stack([numbers[:, :-1], numbers[:, 1:]], axis=-1).reshape(-1, 2)
    along = np.stack([numbers[:-1], numbers[1:]], axis=-1).reshape(-1, 2)
    wrapped = np.radians((angles.ravel() + 180.0) % 360.0 - 180.0)
    return wrapped[:, None] * [0.0, 0.0, 1.0], np.concatenate([across, along])


def unwrapped(turns: Floats, adjacency: Ints) -> tuple[Floats, Floats]:
    """Angles in degrees along the trees alone, and with tears closed."""
    forest = RotationForest(turns, adjacency).rooted(np.linalg.norm(turns, axis=1))
    torn = forest.carried(turns, nearest_branch)
    closed, _ = closed_tears(forest, torn, turns, adjacency)
    return np.degrees(torn[:, 2]), np.degrees(closed[:, 2])


def test_neighbors_that_agree_are_left_as_they_are() -> None:
    angles = np.add.outer(np.linspace(0.0, 90.0, 5), np.linspace(0.0, 400.0, 9))
    torn, closed = unwrapped(*grid_of_turns(angles))
    np.testing.assert_array_equal(closed, torn)
    np.testing.assert_allclose(closed, angles.ravel(), atol=1e-9)


@pytest.mark.parametrize("change", [-1e-7, 0.0, 1e-7])
def test_rounding_does_not_choose_where_a_fold_is_torn(change: float) -> None:
    """Half-way round the fold there are two equal gaps, and the trees leave out the one that is larger by rounding."""
    angles = np.tile(np.linspace(0.0, 130.0, 8), (9, 1))
    angles[4] = [0.0, 0.0, -5.0, -85.0, -145.0 + change, -225.0, -230.0, -230.0]
    _, closed = unwrapped(*grid_of_turns(angles))
    expected = [0.0, 0.0, -5.0, -85.0, -145.0, 135.0, 130.0, 130.0]
    expected[4] = 215.0
    np.testing.assert_allclose(closed.reshape(angles.shape)[4], expected, atol=1e-6)


def test_only_full_turns_are_added_where_no_choice_of_them_agrees() -> None:
    """Around one end of a fold that has no other end."""
    rows, columns = np.mgrid[:8, :8]
    torn, closed = unwrapped(*grid_of_turns(np.degrees(np.arctan2(rows - 3.4, columns - 3.3))))
    turned = (closed - torn) / 360.0
    np.testing.assert_allclose(turned, turned.round(), atol=1e-9)
    assert np.abs(closed).max() < 360.0


def test_what_turns_half_a_turn_from_its_surroundings_counts_nothing() -> None:
    angles = np.tile(np.linspace(0.0, 120.0, 7), (9, 1))
    angles[4] = [0.0, 0.0, 0.0, -120.0, -240.0, -240.0, -240.0]
    turns, adjacency = grid_of_turns(angles)
    forest = RotationForest(turns, adjacency).rooted(np.linalg.norm(turns, axis=1))
    _, certainty = closed_tears(forest, forest.carried(turns, nearest_branch), turns, adjacency)
    assert certainty.reshape(angles.shape)[4, 3] == 0.0
    assert certainty.min() >= 0.0
    assert np.median(certainty) == 1.0


def skinned(points: Floats, degrees: float, width: float) -> Floats:
    """Points bent about the y axis by linear blend skinning, whose weights rise over a ``width`` along z."""
    weights = np.clip(points[:, 2] / width + 0.5, 0.0, 1.0)
    weights = weights**2 * (3.0 - 2.0 * weights)
    turn = rotation_matrices(np.radians(degrees) * np.array([[0.0, 1.0, 0.0]]))[0]
    return points + weights[:, None] * (points @ turn.T - points)


def round_tube(degrees: float) -> tuple[Floats, Floats, Ints]:
    around = 2.0 * np.pi * np.arange(SIDES) / SIDES
    heights = np.linspace(-2.0, 2.0, RINGS + 1)
    circle = 0.3 * np.stack([np.cos(around), np.sin(around), np.zeros(SIDES)], axis=1)
    points = (circle + heights[:, None, None] * [0.0, 0.0, 1.0]).reshape(-1, 3)
    first = np.arange(SIDES * RINGS)
    beside = first - first % SIDES + (first + 1) % SIDES
    faces = np.concatenate(
        [np.stack([first, beside, beside + SIDES], axis=1), np.stack([first, beside + SIDES, first + SIDES], axis=1)]
    )
    return points, skinned(points, degrees, 0.3), faces


def square_tube(degrees: float) -> tuple[Floats, Floats, Ints]:
    """Triangles of its inner side turn over by exactly half a turn."""
    points, faces = box_surface((3, 3, 12), (0.6, 0.6, 4.0))
    points = points - [0.0, 0.0, 2.0]
    return points, skinned(points, degrees, 0.4), faces


@pytest.mark.slow
@pytest.mark.usefixtures("coarse_volume")
@pytest.mark.parametrize(
    ("key0", "key1", "faces"), [round_tube(130.0), round_tube(150.0), square_tube(120.0)], ids=["130", "150", "square"]
)
def test_a_sharply_bent_tube_stays_in_its_plane_and_does_not_jump(key0: Floats, key1: Floats, faces: Ints) -> None:
    frames = qc3d.bake([key0, key1], faces, 1).frames
    mirrored = key0 * [1.0, -1.0, 1.0]
    partners = np.argmin(np.linalg.norm(key0[:, None] - mirrored, axis=2), axis=0)
    np.testing.assert_allclose(frames[:, partners] * [1.0, -1.0, 1.0], frames, rtol=0.0, atol=1e-9)
    noise = np.random.default_rng(1).normal(size=key1.shape)
    changed = qc3d.bake([key0, key1 + 1e-6 * noise], faces, 1).frames
    np.testing.assert_allclose(changed, frames, rtol=0.0, atol=1e-4)
    turn = rotation_matrices(np.array([[0.3, 0.8, -0.5]]))[0]
    moved = qc3d.bake([1.7 * key @ turn.T + [0.4, -2.0, 1.0] for key in (key0, key1)], faces, 1).frames
    np.testing.assert_allclose(moved, 1.7 * frames @ turn.T + [0.4, -2.0, 1.0], rtol=0.0, atol=1e-8)
