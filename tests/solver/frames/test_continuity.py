# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys that change by a millionth of their size change frames by a ten-thousandth at most, in limit cases too."""

from __future__ import annotations

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.numerics.rotations import rotation_matrices

from ..meshes import box_surface, icosphere, sheet, twisted

pytestmark = [pytest.mark.usefixtures("coarse_volume"), pytest.mark.slow]

CHANGE, MOST = 1e-6, 1e-4


def moved_by(key0: Floats, key1: Floats, faces: Ints, seed: int) -> float:
    """How far frames move, over the diagonal, if every vertex of both keys moves by up to a millionth of it."""
    size = float(np.linalg.norm(np.ptp(key0, axis=0)))
    noise = np.random.default_rng(seed).uniform(-1.0, 1.0, (2, *key0.shape)) * CHANGE * size / 3.0**0.5
    plain = qc3d.bake([key0, key1], faces, 3).frames
    changed = qc3d.bake([key0 + noise[0], key1 + noise[1]], faces, 3).frames
    return float(np.linalg.norm(changed - plain, axis=2).max()) / size


@pytest.mark.parametrize("seed", range(3))
def test_random_boxes_of_flat_quads(seed: int) -> None:
    """Whether two triangles are one flat face must not depend on so little."""
    random = np.random.default_rng(seed)
    points, faces = box_surface((2, 3, 4), tuple(random.uniform(0.5, 2.0, size=3).tolist()))
    stretched = points * random.uniform(0.6, 1.5, size=3)
    turn = rotation_matrices(random.normal(scale=0.5, size=(1, 3)))[0]
    assert moved_by(points, stretched @ turn.T, faces, seed) < MOST


@pytest.mark.parametrize("seed", range(2))
def test_a_random_seam_that_is_just_closed(seed: int) -> None:
    """Copies of a vertex, exactly at the same place or a little apart, stay together."""
    random = np.random.default_rng(seed)
    points, faces = box_surface((2, 2, 6), (1.0, 1.0, 4.0))
    upper = points[faces].mean(axis=1)[:, 2] > 2.0
    copies = np.unique(faces[upper])
    number = np.arange(len(points))
    number[copies] = len(points) + np.arange(len(copies))
    split = np.where(upper[:, None], number[faces], faces)
    used = np.unique(split)
    both = np.concatenate([points, points[copies]])[used]
    split = np.searchsorted(used, split)
    assert moved_by(both, twisted(both, random.uniform(0.5, 1.5)), split, seed) < MOST


@pytest.mark.parametrize("seed", range(2))
def test_half_a_turn_keeps_its_way(seed: int) -> None:
    """Both ways round are as long: which one is taken must not depend on so little."""
    points, faces = box_surface((1, 2, 4), (0.5, 1.0, 3.0))
    turn = rotation_matrices(np.pi * np.array([[0.0, 0.6, 0.8]]))[0]
    assert moved_by(points, points @ turn.T, faces, seed) < MOST


@pytest.mark.parametrize("seed", range(2))
def test_loose_pieces_far_from_each_other(seed: int) -> None:
    """Their places must not depend on the tetrahedra of the volume, which are others for every key."""
    random = np.random.default_rng(seed)
    box, faces = box_surface((1, 1, 1), (1.0, 0.7, 0.4))
    places = random.uniform(0.0, 12.0, size=(25, 1, 3))
    turns = rotation_matrices(random.normal(size=(25, 3)))
    key0 = (box + places).reshape(-1, 3)
    key1 = (box @ turns.transpose(0, 2, 1) + places + random.normal(size=(25, 1, 3)) - [0.0, 0.0, 9.0]).reshape(-1, 3)
    every = (faces + len(box) * np.arange(25)[:, None, None]).reshape(-1, 3)
    assert moved_by(key0, key1, every, seed) < MOST


@pytest.mark.parametrize("angle", [90.0, 180.0])
def test_a_page_about_its_still_spine(angle: float) -> None:
    page, faces = sheet((8, 4), (1.0, 1.0))
    page = page + [0.5, 0.0, 0.0]  # its spine on the y axis
    turned = page @ rotation_matrices(np.radians([[0.0, -angle, 0.0]]))[0].T
    assert moved_by(page, turned, faces, 0) < MOST


def test_what_is_pressed_flat() -> None:
    """Triangles that are pressed to a line have no direction, with or without rounding."""
    points, faces = icosphere(2, 1.0)
    points = np.where(np.abs(points - 0.5) < 1e-9, 0.5, points)
    flat = points * [1.0, 1.0, 0.0]
    assert moved_by(points, flat, faces, 1) < MOST


@pytest.mark.parametrize("turns", [0.735, 0.77])
def test_twists_of_about_three_quarters_of_a_turn(turns: float) -> None:
    """From there on, a part's turn is taken apart into a twist and a swing; that must not set in at once."""
    points, faces = box_surface((2, 2, 10), (1.0, 1.0, 5.0))
    assert moved_by(points, twisted(points, 2.0 * np.pi * turns), faces, 2) < MOST
