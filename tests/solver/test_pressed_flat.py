# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is pressed flat, or passes through its own plane, goes straight where that keeps lengths and volumes."""

from __future__ import annotations

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.numerics.rotations import rotation_matrices

from .meshes import box_surface, enclosed_volume, icosphere, sheet

pytestmark = pytest.mark.usefixtures("coarse_volume")

BOX, BOX_FACES = box_surface((1, 1, 1), (1.0, 1.0, 1.0))
BALL, BALL_FACES = icosphere(2, 1.0)
BASE = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.6, 0.6, 0.3]])
SIDES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def pyramid(height: float) -> Floats:
    return np.concatenate([BASE[:3], [[0.6, 0.6, height]]])


def off_line(key0: Floats, key1: Floats, faces: Ints) -> float:
    """How far frames are from the straight blend, over the size."""
    bake = qc3d.bake([key0, key1], faces, 3)
    lines = key0 + bake.times[:, None, None] * (key1 - key0)
    return float(np.linalg.norm(bake.frames - lines, axis=2).max() / np.linalg.norm(np.ptp(key0, axis=0)))


@pytest.mark.parametrize("left", [0.1, 1e-3, 1e-6, 0.0])
@pytest.mark.parametrize(("points", "faces"), [(BOX, BOX_FACES), (BALL, BALL_FACES)], ids=["box", "ball"])
def test_a_box_and_a_ball_that_are_pressed_flat(points: Floats, faces: Ints, left: float) -> None:
    """Whether their sides are still triangles, or lines already, does not matter."""
    flat = points * [1.0, 1.0, left]
    assert off_line(points, flat, faces) < 1e-5
    assert off_line(flat, points, faces) < 2e-3


@pytest.mark.parametrize("left", [1e-3, 1e-6, 0.0])
def test_a_plane_that_shrinks_to_a_line(left: float) -> None:
    points, faces = sheet((5, 5), (1.0, 1.0))
    assert off_line(points, np.stack([0.5 + left * (points[:, 0] - 0.5), *points[:, 1:].T], axis=1), faces) < 2e-4


@pytest.mark.parametrize("height", [0.01, 0.0, -0.001, -0.03, -0.1, -0.3])
def test_a_flat_pyramid_passes_through_its_base(height: float) -> None:
    assert off_line(BASE, pyramid(height), SIDES) < 0.002


def test_one_that_also_turns_passes_through_its_base() -> None:
    turn = rotation_matrices(np.array([[0.3, 1.9, -0.5]]))[0]
    bake = qc3d.bake([BASE, pyramid(-0.3) @ turn.T + [3.0, 1.0, 0.0]], SIDES, 3)
    spans = bake.frames[:, :3] - bake.frames[:, [1, 2, 0]]
    lengths = np.linalg.norm(BASE[:3] - BASE[[1, 2, 0]], axis=1)
    np.testing.assert_allclose(np.linalg.norm(spans, axis=2), np.broadcast_to(lengths, (5, 3)), rtol=1e-3)
    heights = np.einsum("ki,ki->k", np.cross(spans[:, 0], spans[:, 1]), bake.frames[:, 3] - bake.frames[:, 0])
    assert (np.diff(np.sign(heights[0]) * heights) < 0.0).all()


@pytest.mark.parametrize("height", [-2.0, -1.0])
def test_a_high_pyramid_turned_inside_out_is_refused(height: float) -> None:
    with pytest.raises(qc3d.InputError, match="inside out"):
        qc3d.bake([pyramid(-height), pyramid(height)], SIDES, 3)


@pytest.mark.parametrize("shear", [0.5, 1.0])
def test_what_keeps_lengths_and_volume_on_straight_lines_goes_straight(shear: float) -> None:
    key1 = BOX + shear * BOX[:, 2:] * [1.0, 0.0, 0.0]
    bake = qc3d.bake([BOX, key1], BOX_FACES, 3)
    np.testing.assert_allclose([enclosed_volume(frame, BOX_FACES) for frame in bake.frames], 1.0, rtol=1e-4)
    assert off_line(BOX, key1, BOX_FACES) < 1e-4
