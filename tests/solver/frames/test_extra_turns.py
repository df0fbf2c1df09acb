# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Extra turns: which parts get them, about which axis; keys, lengths and still vertices stay as they are."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.frames.extra_turns import ExtraSpins
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.surface.path import SurfacePath

from ..meshes import arced, box_surface, icosphere, twisted

BAR, FACES = box_surface((2, 2, 8), (1.0, 1.0, 5.0))
BALL, BALL_FACES = icosphere(1)
FAR = np.array([4.0, 0.0, 2.0])
TURN = np.array([0.5, 0.2, -0.4])


def spun_between(key0: Floats, key1: Floats, faces: Ints, turns: int) -> tuple[Embedding, ExtraSpins]:
    embedding = Embedding.of(KeyPair.checked(key0, key1, faces))
    return embedding, ExtraSpins(embedding, SurfacePath(embedding), turns)


def turned(points: Floats, turn: Floats, pivot: Floats) -> Floats:
    return np.asarray((points - pivot) @ rotation_matrices(turn[None])[0].T + pivot)


def beside_a_still_bar(part0: Floats, part1: Floats, faces: Ints) -> tuple[Floats, Floats, Ints]:
    return np.concatenate([BAR, part0]), np.concatenate([BAR, part1]), np.concatenate([FACES, faces + len(BAR)])


@pytest.mark.parametrize("turns", [1, -2])
def test_a_loose_part_turns_about_its_middle(turns: int) -> None:
    ball = BALL + FAR
    middle = ball.mean(axis=0)
    keys = beside_a_still_bar(ball, turned(ball, TURN, middle), BALL_FACES)
    embedding, spins = spun_between(*keys, turns)
    axis = TURN / np.linalg.norm(TURN)
    for time in (0.0, 0.2, 0.5, 1.0):
        expected = turned(ball, 2.0 * np.pi * turns * time * axis, middle)
        found = spins.apply(embedding.key0, time)
        np.testing.assert_allclose(found[len(BAR) :], embedding.to_cube(expected), rtol=0.0, atol=1e-4)
        np.testing.assert_array_equal(found[: len(BAR)], embedding.key0[: len(BAR)])


@pytest.mark.parametrize("count", [1, 2])
def test_a_part_on_a_still_axis_turns_about_that(count: int) -> None:
    # A lamp on its hook, a door in its hinges: one vertex, or two, stay while the rest swings.
    pivots = BAR[[0, 8]][:count] if count == 2 else BAR[[20]]
    axis = pivots[-1] - pivots[0] if count == 2 else TURN
    part1 = turned(BAR, 0.8 * axis / np.linalg.norm(axis), pivots[0])
    part1[np.linalg.norm(part1 - BAR, axis=1) < 1e-9] = BAR[np.linalg.norm(part1 - BAR, axis=1) < 1e-9]
    keys = beside_a_still_bar(BAR + FAR, part1 + FAR, FACES)
    embedding, spins = spun_between(*keys, 1)
    assert embedding.still[len(BAR) :].any()
    expected = turned(BAR, np.pi * axis / np.linalg.norm(axis), pivots[0]) + FAR
    found = spins.apply(embedding.key0, 0.5)
    np.testing.assert_allclose(found[len(BAR) :], embedding.to_cube(expected), rtol=0.0, atol=1e-9)


def test_everything_spins_as_one_where_nothing_is_still() -> None:
    points = np.concatenate([BAR, BALL + FAR])
    faces = np.concatenate([FACES, BALL_FACES + len(BAR)])
    embedding, spins = spun_between(points, turned(points, TURN, FAR) + 3.0, faces, 1)
    found = spins.apply(embedding.key0, 0.3)
    middle = embedding.weights @ embedding.key0
    expected = turned(embedding.key0, 0.6 * np.pi * embedding.axes @ TURN / np.linalg.norm(TURN), middle)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "turns"), [("no turns", 0), ("held", 1), ("only moved", 1), ("nothing turns", 1), ("identical", 1)]
)
def test_nothing_spins(name: str, turns: int) -> None:
    keys = {
        "no turns": beside_a_still_bar(BALL + FAR, turned(BALL + FAR, TURN, FAR), BALL_FACES),
        "held": beside_a_still_bar(BAR + FAR, arced(BAR, 1.0) + FAR, FACES),
        "only moved": beside_a_still_bar(BALL + FAR, BALL + 2.0 * FAR, BALL_FACES),
        "nothing turns": (BAR, BAR + 1.0, FACES),
        "identical": (BAR, BAR, FACES),
    }[name]
    embedding, spins = spun_between(*keys, turns)
    assert not spins
    np.testing.assert_array_equal(spins.apply(embedding.key0, 0.5), embedding.key0)


def test_keys_and_lengths_stay() -> None:
    ball = BALL + FAR
    wound = twisted(ball, 1.0) @ rotation_matrices(TURN[None])[0].T
    embedding, spins = spun_between(*beside_a_still_bar(ball, wound, BALL_FACES), 3)
    assert spins
    np.testing.assert_array_equal(spins.apply(embedding.key0, 0.0), embedding.key0)
    np.testing.assert_allclose(spins.apply(embedding.key1, 1.0), embedding.key1, rtol=0.0, atol=1e-14)
    before, after = (
        np.linalg.norm(shape[:, None] - shape, axis=2)[len(BAR) :, len(BAR) :]
        for shape in (embedding.key0, spins.apply(embedding.key0, 0.37))
    )
    np.testing.assert_allclose(after, before, rtol=0.0, atol=1e-14)
