# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose parts follow the surface around them, or go straight where it turns in all directions."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.surface.path import SurfacePath

from ..meshes import box_surface

BOX, FACES = box_surface((1, 1, 1), (1.0, 1.0, 1.0))


def copies(count: int) -> Ints:
    return (FACES + 8 * np.arange(count)[:, None, None]).reshape(-1, 3)


def halfway(key0: Floats, key1: Floats, faces: Ints) -> Floats:
    embedding = Embedding.of(KeyPair.checked(key0, key1, faces))
    return embedding.from_cube(SurfacePath(embedding).positions(0.5), 0.5)


def test_pieces_in_a_row_follow_the_arc_that_they_turn_by() -> None:
    """A row of loose pieces, like a tail of beads with gaps, that turns about a still base."""
    places = np.linspace(0.0, 12.0, 7)[:, None, None] * [0.0, 0.0, 1.0]
    key0 = (0.8 * BOX + places).reshape(-1, 3)
    turned = lambda angle: (key0 + [0.0, 0.0, 1.0]) @ rotation_matrices(np.array([[angle, 0.0, 0.0]]))[0].T  # noqa: E731
    key1 = turned(1.2) - [0.0, 0.0, 1.0]
    base = 4.0 * BOX - [0.0, 0.0, 6.0]
    shape = halfway(np.concatenate([key0, base]), np.concatenate([key1, base]), copies(8))
    expected = turned(0.6) - [0.0, 0.0, 1.0]
    straight = 0.5 * (key0 + key1)
    off = np.linalg.norm(shape[: len(key0)] - expected, axis=1).max()
    assert off < 0.2 * np.linalg.norm(straight - expected, axis=1).max()


def test_scattered_pieces_that_turn_each_its_own_way_fall_straight() -> None:
    random = np.random.default_rng(3)
    turns = [rotation_matrices(random.normal(scale=1.2, size=(30, 3))) for _ in range(2)]
    places = random.uniform(0.0, 20.0, size=(30, 1, 3))
    first = (BOX - [0.0, 0.0, 0.5]) @ turns[0].transpose(0, 2, 1)
    second = (BOX - [0.0, 0.0, 0.5]) @ (turns[1] @ turns[0]).transpose(0, 2, 1)
    key0, key1 = first + places, second + places - [0.0, 0.0, 30.0]
    floor = 40.0 * BOX[None] * [1.0, 1.0, 0.01] - [0.0, 0.0, 45.0]
    keys = [np.concatenate([key, floor]).reshape(-1, 3) for key in (key0, key1)]
    centers = halfway(*keys, copies(31)).reshape(31, 8, 3)[:30].mean(axis=1)
    off = np.linalg.norm(centers - 0.5 * (key0 + key1).mean(axis=1), axis=1)
    assert np.median(off) < 0.003 * 30.0
    assert off.max() < 0.1 * 30.0


@pytest.mark.parametrize("seed", range(3))
def test_a_millionth_moves_no_part_by_more_than_a_few(seed: int) -> None:
    random = np.random.default_rng(seed)
    places = random.uniform(0.0, 6.0, size=(12, 1, 3))
    turns = rotation_matrices(random.normal(size=(12, 3)))
    key0 = (BOX + places).reshape(-1, 3)
    key1 = (BOX @ turns.transpose(0, 2, 1) + random.normal(scale=3.0, size=(12, 1, 3)) + places).reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(key0, axis=0)))
    noise = random.uniform(-1e-6, 1e-6, (2, *key0.shape)) * size
    before, after = halfway(key0, key1, copies(12)), halfway(key0 + noise[0], key1 + noise[1], copies(12))
    assert np.linalg.norm(after - before, axis=1).max() < 2e-5 * size
