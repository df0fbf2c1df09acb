# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose pieces: congruent ones move rigidly, none runs into another, and half turns go where nothing is in the way."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision.self_crossings import PairCrossings
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.surface.rigid_parts import RigidParts

from .meshes import box_surface

pytestmark = [pytest.mark.usefixtures("coarse_volume"), pytest.mark.slow]

CARD = np.array([[-0.5, -0.7, 0.0], [0.5, -0.7, 0.0], [0.5, 0.7, 0.0], [-0.5, 0.7, 0.0]])
CARD_FACES = np.array([[0, 1, 2], [0, 2, 3]])
BOX, BOX_FACES = box_surface((1, 1, 1), (1.0, 1.0, 1.0))


def scattered(shape: Floats, faces: Ints, count: int, size: float = 1.0, seed: int = 1) -> tuple[Floats, Floats, Ints]:
    """Copies of a shape in random places, which turn and fall in the second key."""
    random = np.random.default_rng(seed)
    places = random.uniform(0.0, 10.0, size=(count, 1, 3))
    first = rotation_matrices(random.normal(scale=2.0, size=(count, 3)))
    second = rotation_matrices(random.normal(scale=1.0, size=(count, 3))) @ first
    key0 = size * shape @ first.transpose(0, 2, 1) + places
    key1 = size * shape @ second.transpose(0, 2, 1) + places + random.normal(size=(count, 1, 3)) - [0.0, 0.0, 12.0]
    number = np.arange(count)[:, None, None] * len(shape)
    return key0.reshape(-1, 3), key1.reshape(-1, 3), (faces + number).reshape(-1, 3)


def rigid_misfit(first: Floats, second: Floats) -> float:
    spread, other = first - first.mean(axis=0), second - second.mean(axis=0)
    left, _, right = np.linalg.svd(spread.T @ other)
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    return float(np.linalg.norm(spread @ turn - other, axis=1).max() / np.linalg.norm(spread, axis=1).max())


@pytest.mark.parametrize(("shape", "faces"), [(CARD, CARD_FACES), (BOX, BOX_FACES)], ids=["cards", "boxes"])
def test_congruent_pieces_are_rigid_and_cross_no_more_than_the_straight_blend(shape: Floats, faces: Ints) -> None:
    key0, key1, triangles = scattered(shape, faces, 60)
    bake = qc3d.bake([key0, key1], triangles, 3)
    counts = PairCrossings(KeyPair.checked(key0, key1, triangles))
    for time, frame in zip(bake.times[1:-1], bake.frames[1:-1], strict=True):
        pieces = zip(key0.reshape(60, -1, 3), frame.reshape(60, -1, 3), strict=True)
        assert max(rigid_misfit(*piece) for piece in pieces) < 1e-9
        straight = counts.excess((1.0 - time) * key0 + time * key1)
        assert counts.excess(frame) <= straight


def test_a_piece_that_is_turned_inside_out_goes_straight_and_the_others_stay_rigid() -> None:
    key0, key1, triangles = scattered(BOX, BOX_FACES, 6)
    inside_out = slice(2 * len(BOX), 3 * len(BOX))
    middle = key1[inside_out].mean(axis=0)
    key1[inside_out] = middle + (key1[inside_out] - middle) * [0.4, 0.3, -0.3]
    key1[: len(BOX)] = key0[: len(BOX)]  # still: so the whole has no motion of its own
    bake = qc3d.bake([key0, key1], triangles, 3)
    straight = key0 + bake.times[:, None, None] * (key1 - key0)
    assert np.abs((bake.frames - straight)[:, inside_out]).max() < 1e-5
    others = [piece for piece in range(6) if piece != 2]
    for frame in bake.frames[1:-1]:
        pieces = zip(key0.reshape(6, -1, 3)[others], frame.reshape(6, -1, 3)[others], strict=True)
        assert max(rigid_misfit(*piece) for piece in pieces) < 1e-9
    assert any("turned inside out" in note for note in bake.report.notes)


def wing(angle: float, side: float) -> tuple[Floats, Ints]:
    """A plate of length 1 whose angle against the horizon grows by half along its span, in degrees."""
    flat, faces = box_surface((8, 3, 1), (1.0, 0.5, 0.02))
    along = np.linspace(0.0, 1.0, 401)
    slopes = np.radians(angle) * (1.0 + 0.5 * along)
    arc = np.cumsum(np.stack([np.cos(slopes), np.sin(slopes)])[:, :-1] / 400.0, axis=1)
    arc = np.concatenate([np.zeros((2, 1)), arc], axis=1)
    span = flat[:, 0] + 0.5
    x, z = (np.interp(span, along, coordinate) for coordinate in arc)
    slope, height = np.radians(angle) * (1.0 + 0.5 * span), flat[:, 2] - 0.01
    points = np.column_stack([side * (0.12 + x - height * np.sin(slope)), flat[:, 1], z + height * np.cos(slope)])
    return points, faces if side > 0.0 else faces[:, ::-1]


def test_a_bird_of_three_loose_parts() -> None:
    """The body stays calm, and the wings, which bend, keep their lengths and stay beside it."""
    body, faces = box_surface((2, 6, 2), (0.2, 0.9, 0.2))
    keys, triangles = [], [faces]
    for angle, lift in ((-60.0, 0.0), (60.0, 0.02)):
        wings = [wing(angle, side) for side in (1.0, -1.0)]
        keys.append(np.concatenate([body - [0.0, 0.0, 0.1], *(points for points, _ in wings)]) + [0.0, 0.0, lift])
    count = len(wings[0][0])
    triangles += [wings[0][1] + len(body), wings[1][1] + len(body) + count]
    every = np.concatenate(triangles)
    bake = qc3d.bake(keys, every, 3)
    assert bake.report.crossings == [0] * 5
    straight = keys[0] + bake.times[:, None, None] * (keys[1] - keys[0])
    assert np.abs((bake.frames - straight)[:, : len(body)]).max() < 2e-3
    roots = np.flatnonzero(np.abs(keys[0][:, 0]) < 0.14)
    assert np.abs((bake.frames - straight)[:, roots]).max() < 0.02
    spans = bake.frames[:, every] - np.roll(bake.frames[:, every], 1, axis=2)
    lengths = np.linalg.norm(spans, axis=3).reshape(5, -1)
    low, high = np.minimum(lengths[0], lengths[-1]), np.maximum(lengths[0], lengths[-1])
    assert np.percentile(np.maximum(low / lengths, lengths / high) - 1.0, 99) < 2e-3


class TestRigidParts:
    def parts(self, change: float = 0.0) -> tuple[RigidParts, Floats, Floats]:
        key0, key1, _ = scattered(BOX, BOX_FACES, 3)
        key1 = key1 + change * np.random.default_rng(5).normal(size=key1.shape)
        labels = np.repeat(np.arange(3), len(BOX))
        return RigidParts(key0, key1, labels == 2, np.ones(len(key0)), labels), key0, key1

    def test_the_keys_are_met(self) -> None:
        for change in (0.0, 3e-5, 1e-2):
            rigid, key0, key1 = self.parts(change)
            np.testing.assert_allclose(rigid.placed(key0, 0.0), key0, atol=1e-12)
            np.testing.assert_allclose(rigid.placed(key1, 1.0), key1, atol=1e-12)

    def test_only_what_is_congruent_and_rests_nowhere(self) -> None:
        rigid, key0, key1 = self.parts()
        bowed = 0.5 * (key0 + key1)
        placed = rigid.placed(bowed, 0.5)
        first, last = slice(0, len(BOX)), slice(2 * len(BOX), None)
        assert rigid_misfit(key0[first], placed[first]) < 1e-12
        np.testing.assert_allclose(placed[first].mean(axis=0), bowed[first].mean(axis=0))
        assert np.array_equal(placed[last], bowed[last])
        loose, key0, key1 = self.parts(1e-2)
        assert np.array_equal(loose.placed(bowed, 0.5), bowed)

    def test_by_degrees(self) -> None:
        """A little more or less of a difference between the keys changes frames a little."""
        bowed = 0.5 * sum(self.parts()[1:])
        moved = [self.parts(change)[0].placed(bowed, 0.5) for change in np.linspace(0.0, 1e-3, 200)]
        steps = [np.abs(second - first).max() for first, second in itertools.pairwise(moved)]
        assert np.abs(moved[-1] - moved[0]).max() > 0.05
        assert max(steps) < 0.02


def book(angle: float, gap: float = 0.02) -> tuple[Floats, Floats, Ints]:
    """A page of 5 x 3 points that turns about the y axis by an angle, in degrees, over two covers that stay."""
    across, along = np.meshgrid(np.linspace(0.0, 1.0, 5), np.linspace(-0.7, 0.7, 3), indexing="ij")
    page = np.stack([across, along, np.zeros_like(across)], axis=2).reshape(-1, 3)
    covers = np.concatenate([page - [0.0, 0.0, gap], page * [-1.0, 1.0, 1.0] - [0.0, 0.0, gap]])
    cell = np.array([[0, 3, 4], [0, 4, 1]])
    faces = np.concatenate([cell + 3 * column + row for column in range(4) for row in range(2)])
    turn = rotation_matrices(np.array([[0.0, -np.radians(angle), 0.0]]))[0]
    every = np.concatenate([faces, faces + 15, faces[:, ::-1] + 30])
    return np.concatenate([page, covers]), np.concatenate([page @ turn.T, covers]), every


class TestHalfTurns:
    @pytest.mark.parametrize("angle", [170.0, 180.0, -180.0])
    @pytest.mark.parametrize("mirror", [1.0, -1.0])
    def test_a_page_goes_over_its_covers(self, angle: float, mirror: float) -> None:
        key0, key1, faces = book(angle)
        key0, key1 = key0 * [1.0, 1.0, mirror], key1 * [1.0, 1.0, mirror]
        bake = qc3d.bake([key0, key1], faces, 3)
        assert bake.report.crossings == [0] * 5
        page = bake.frames[2][:15]
        assert mirror * page[:, 2].max() > 0.9 or mirror * page[:, 2].min() > -1e-6
        assert rigid_misfit(key0[:15], page) < 1e-3

    def test_the_other_way_where_it_is_asked_for(self) -> None:
        key0, key1, faces = book(180.0, gap=-0.02)
        below = qc3d.bake([key0, key1], faces, 1)
        assert below.frames[1][:15, 2].min() < -0.9
        assert any("-1 as extra turns takes the other way" in note for note in below.report.notes)
        through = qc3d.bake([key0, key1], faces, 1, extra_turns=-1).frames[1][:15]
        assert through[:, 2].max() > 0.9  # through what is in the way, as rigid as ever
        assert rigid_misfit(key0[:15], through) < 1e-3
