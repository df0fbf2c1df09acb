# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What crosses itself more often than in the straight blend goes straight there, unless lengths would suffer."""

from __future__ import annotations

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision.self_crossings import CrossingLimit
from qc3d_addon.solver.frames import natural
from qc3d_addon.solver.frames.straighter import Straighter, more_than
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.surface.path import SurfacePath

from ..meshes import box_surface

LONG = 20  # columns of the strip
STRIP = 3 * (LONG + 1)
MIDDLE = 0.5


def turned(points: Floats, degrees: float) -> Floats:
    return np.asarray(points @ rotation_matrices(np.radians([[0.0, 0.0, degrees]]))[0].T)


def strip_and_stone(angle: float, reach: float) -> tuple[Floats, Floats, Ints]:
    """A strip that turns about its end like a hand of a clock, and a stone at a distance ``reach``, half-way.

    The strip's end, at distance 1, runs into the stone along its arc, and passes it along a straight line.
    """
    along, across = np.meshgrid(np.linspace(0.0, 1.0, LONG + 1), [-0.1, 0.0, 0.1], indexing="ij")
    strip = np.stack([along, np.zeros_like(along), across], axis=2).reshape(-1, 3)
    cell = np.array([[0, 3, 4], [0, 4, 1]])
    faces = np.concatenate([cell + 3 * column + row for column in range(LONG) for row in range(2)])
    stone, sides = box_surface((1, 1, 1), (0.2, 0.01, 0.05))
    stone = stone + [reach + 0.1, 0.0, -0.025]
    keys = [np.concatenate([turned(strip, end), stone]) for end in (-0.5 * angle, 0.5 * angle)]
    return keys[0], keys[1], np.concatenate([faces, sides + STRIP])


def apart(angle: float, reach: float) -> tuple[list[Floats], list[Floats], list[Floats], SurfacePath, list[int]]:
    """Shapes before and after, the straight lines, the path, and the crossings that are left."""
    key0, key1, faces = strip_and_stone(angle, reach)
    embedding = Embedding.of(KeyPair.checked(key0, key1, faces))
    path = SurfacePath(embedding)
    limit = CrossingLimit(faces, embedding.key0, embedding.key1, embedding.still)
    times = [0.25, MIDDLE, 0.75]
    shapes = path.shapes([(time, None) for time in times])
    lines = [embedding.straight(time) for time in times]
    excess = [limit.excess(shape) for shape in shapes]
    assert any(excess)
    assert not any(limit.excess(line) for line in lines)
    found = Straighter(limit, path, [1.0] * 3).apart(shapes, lines, excess)
    assert found.excess == [limit.excess(shape) for shape in found.shapes]
    return shapes, found.shapes, lines, path, more_than(found.excess, found.straight_excess)


def test_an_end_goes_straight_past_a_stone_and_the_rest_keeps_to_its_arc() -> None:
    shapes, found, lines, path, over = apart(6.0, 0.9993)
    assert not over
    moved = np.linalg.norm(found[1] - shapes[1], axis=1)
    tip = slice(3 * LONG, STRIP)
    np.testing.assert_allclose(found[1][tip], lines[1][tip], atol=1e-12)
    assert moved[: 3 * (LONG // 2 - 2)].max() == 0.0
    assert path.length_excess(found[1]) < 0.004


def test_lengths_come_first_where_the_straight_blend_loses_too_many() -> None:
    shapes, found, _, _, over = apart(100.0, 0.95)
    assert over
    assert all(np.array_equal(before, after) for before, after in zip(shapes, found, strict=True))


def test_beside_inner_keys_of_a_chain_only_a_part() -> None:
    key0, key1, faces = strip_and_stone(20.0, 0.99)
    embedding = Embedding.of(KeyPair.checked(key0, key1, faces))
    path = SurfacePath(embedding)
    limit = CrossingLimit(faces, embedding.key0, embedding.key1, embedding.still)
    shape, line = path.positions(MIDDLE), embedding.straight(MIDDLE)
    found = Straighter(limit, path, [0.9]).apart([shape], [line], [limit.excess(shape)])
    tip = slice(3 * LONG, STRIP)
    np.testing.assert_allclose(found.shapes[0][tip], (0.1 * shape + 0.9 * line)[tip], atol=1e-12)


@pytest.mark.usefixtures("coarse_volume")
class TestBakes:
    def test_none_crosses_more_than_the_straight_blend(self) -> None:
        key0, key1, faces = strip_and_stone(20.0, 0.99)
        bake = qc3d.bake([key0, key1], faces, 3)
        assert bake.report.crossings == [0] * 5

    def test_what_is_left_is_said(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(natural, "_UNCROSSING_ATTEMPTS", 0)
        key0, key1, faces = strip_and_stone(140.0, 0.6)
        bake = qc3d.bake([key0, key1], faces, 3)
        assert max(bake.report.crossings) > 0
        assert any("more pairs of triangles that cross than the straight blend" in note for note in bake.report.notes)
