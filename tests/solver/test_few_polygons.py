# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of few polygons: their sides stay flat, whatever diagonals they were triangulated along."""

from __future__ import annotations

import time

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.surface.path import SurfacePath
from qc3d_addon.solver.triangles.topology import sides, unique_edges

from .meshes import box_surface, enclosed_volume, icosphere, twisted

BOX, BOX_FACES = box_surface((1, 1, 1), (1.0, 1.0, 1.0))
TIMES = (0.25, 0.5, 0.75)


def prism(corners: int) -> tuple[Floats, Ints, Ints]:
    """A prism over a regular polygon: its points, triangles and polygons."""
    angle = np.arange(corners) * 2.0 * np.pi / corners
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], axis=1)
    points = np.concatenate([ring, ring + [0.0, 0.0, 2.0]])
    first, second = np.arange(corners), np.roll(np.arange(corners), -1)
    fan = np.stack([np.zeros(corners - 2, dtype=int), first[1:-1], first[2:]], axis=1)
    walls = np.stack([first, second, second + corners, first + corners], axis=1)
    faces = np.concatenate([fan[:, ::-1], fan + corners, walls[:, [0, 1, 2]], walls[:, [0, 2, 3]]])
    polygons = np.concatenate([np.zeros(corners - 2), np.ones(corners - 2), first + 2, first + 2])
    return points, faces, polygons.astype(np.int64)


def shapes_between(pair: KeyPair) -> list[Floats]:
    """Shapes between the keys in units of the cube, along the axes of the keys."""
    embedding = Embedding.of(pair)
    shapes = SurfacePath(embedding).shapes([(time, None) for time in TIMES])
    return [embedding.scale * embedding.from_cube(shape, time) for shape, time in zip(shapes, TIMES, strict=True)]


def out_of_plane(shape: Floats, loop: Ints) -> float:
    spread = shape[loop] - shape[loop].mean(axis=0)
    return float(np.linalg.svd(spread)[1][2]) / float(np.linalg.norm(spread))


def test_a_box_stretched_one_way_then_another_stays_a_box() -> None:
    first, second = BOX * [1.0, 1.0, 2.0], BOX * [2.0, 1.0, 1.0]
    pair = KeyPair.checked(first, second, BOX_FACES)
    scale = Embedding.of(pair).scale
    for shape, moment in zip(shapes_between(pair), TIMES, strict=True):
        for axis in range(3):
            for end in (BOX[:, axis].min(), BOX[:, axis].max()):
                assert out_of_plane(shape, np.flatnonzero(BOX[:, axis] == end)) < 1e-3
        wanted = np.ptp((1.0 - moment) * first + moment * second, axis=0) * scale
        np.testing.assert_allclose(np.ptp(shape, axis=0), wanted, rtol=0.01)


@pytest.mark.parametrize("corners", [3, 4, 5, 6, 8, 13])
def test_ends_of_prisms_stay_flat_and_regular(corners: int) -> None:
    points, faces, polygons = prism(corners)
    fat = points * [1.3, 1.3, 0.7]
    pair = KeyPair.checked(points, fat, faces, polygons=polygons)
    for shape in shapes_between(pair):
        for end in (np.arange(corners), np.arange(corners) + corners):
            assert out_of_plane(shape, end) < 1e-6
            radii = np.linalg.norm(shape[end] - shape[end].mean(axis=0), axis=1)
            assert np.ptp(radii) < 1e-6 * radii.mean()


def test_diagonals_do_not_matter() -> None:
    points, faces = box_surface((1, 1, 2), (1.0, 1.0, 3.0))
    half = len(faces) // 2
    loops = np.concatenate([faces[:half], faces[half:, 2:]], axis=1)
    other = np.concatenate([loops[:, [0, 1, 3]], loops[:, [1, 2, 3]]])
    polygons = np.tile(np.arange(half), 2)
    moved = points * [1.5, 0.7, 1.0] + 0.3 * points[:, [2, 0, 1]]
    one, two = (
        shapes_between(KeyPair.checked(points, moved, triangles, polygons=polygons)) for triangles in (faces, other)
    )
    # The volume of what is not flat does depend on them, and with it the shapes, a little.
    apart = max(np.abs(a - b).max() for a, b in zip(one, two, strict=True))
    alone = [shapes_between(KeyPair.checked(points, moved, t, polygons=np.arange(2 * half))) for t in (faces, other)]
    assert apart < 0.2 * max(np.abs(a - b).max() for a, b in zip(*alone, strict=True))


class TestVolumesAndLengths:
    def test_a_ball_holds_its_volume_to_rounding(self) -> None:
        points, faces = icosphere(2)
        flat = points * [1.0, 1.05, 0.95]
        pair = KeyPair.checked(points, flat, faces)
        embedding = Embedding.of(pair)
        ends = [enclosed_volume(key, faces) for key in (embedding.key0, embedding.key1)]
        for shape, moment in zip(shapes_between(pair), TIMES, strict=True):
            wanted = (1.0 - moment) * ends[0] + moment * ends[1]
            assert enclosed_volume(shape, faces) == pytest.approx(wanted, rel=1e-9)

    def test_what_grows_holds_its_volume_too(self) -> None:
        """Lengths that stay between those of the keys cost nothing."""
        pair = KeyPair.checked(BOX, 2.0 * BOX, BOX_FACES)
        embedding = Embedding.of(pair)
        ends = [enclosed_volume(key, BOX_FACES) for key in (embedding.key0, embedding.key1)]
        for shape, moment in zip(shapes_between(pair), TIMES, strict=True):
            wanted = (1.0 - moment) * ends[0] + moment * ends[1]
            assert enclosed_volume(shape, BOX_FACES) == pytest.approx(wanted, rel=1e-9)

    def test_each_part_by_itself(self) -> None:
        """A box that cannot hold its volume does not keep a ball beside it from doing so."""
        ball, ball_faces = icosphere(2)
        first = np.concatenate([BOX * [1.0, 1.0, 2.0], ball + 3.0])
        second = np.concatenate([BOX * [2.0, 1.0, 1.0], ball * [1.0, 1.05, 0.95] + 3.0])
        pair = KeyPair.checked(first, second, np.concatenate([BOX_FACES, ball_faces + len(BOX)]))
        embedding = Embedding.of(pair)
        ends = [enclosed_volume(key[len(BOX) :], ball_faces) for key in (embedding.key0, embedding.key1)]
        for shape, moment in zip(shapes_between(pair), TIMES, strict=True):
            wanted = (1.0 - moment) * ends[0] + moment * ends[1]
            assert enclosed_volume(shape[len(BOX) :], ball_faces) == pytest.approx(wanted, rel=1e-9)


def test_a_box_takes_no_longer_than_a_fine_one() -> None:
    seconds = []
    for cells in ((1, 1, 1), (11, 11, 11)):
        points, faces = box_surface(cells, (1.0, 1.0, 1.0))
        moved = points * np.stack([np.ones(len(points)), np.ones(len(points)), 0.9 + 0.2 * points[:, 0]], axis=1)
        start = time.process_time()
        fit = qc3d.fit(points, moved, faces)
        fit.inbetweens(3)
        seconds.append(time.process_time() - start)
    assert seconds[0] < seconds[1]


def test_volumes_are_held_where_the_straight_blend_is_worse_anyway() -> None:
    """A bar that is twisted and grows: lengths pay for its volume, but less than the straight blend takes from them."""
    points, faces = box_surface((3, 3, 12), (1.0, 1.0, 3.0))
    later = twisted(points, np.radians(150.0)) * [1.5, 1.5, 1.0]
    pair = KeyPair.checked(points, later, faces)
    embedding = Embedding.of(pair)
    ends = [enclosed_volume(key, faces) for key in (embedding.key0, embedding.key1)]
    for shape, moment in zip(shapes_between(pair), TIMES, strict=True):
        wanted = (1.0 - moment) * ends[0] + moment * ends[1]
        assert enclosed_volume(shape, faces) == pytest.approx(wanted, rel=1e-9)


def test_what_is_flattened_is_no_worse_than_the_straight_blend() -> None:
    points, faces = icosphere(3)
    cup = faces[points[faces][:, :, 2].min(axis=1) > 0.35]
    used, corners = np.unique(cup, return_inverse=True)
    corners = corners.reshape(-1, 3)
    cup_points = points[used] + 0.03 * np.sin(40.0 * points[used][:, :1]) * [0.0, 0.0, 1.0]
    pair = KeyPair.checked(cup_points, cup_points * [1.0, 1.0, 0.02], corners)
    edges = unique_edges(sides(corners))
    lengths = [np.linalg.norm(np.diff(shape[edges], axis=1)[:, 0], axis=1) for shape in (pair.key0, pair.key1)]
    scale = Embedding.of(pair).scale
    for shape in shapes_between(pair):
        length = np.linalg.norm(np.diff(shape[edges], axis=1)[:, 0], axis=1) / scale
        excess = np.maximum(length / np.maximum(*lengths) - 1.0, 1.0 - length / np.minimum(*lengths))
        assert np.percentile(excess, 99) < 0.0025


@pytest.mark.parametrize("shear", [0.25, 0.5])
def test_a_sheared_box_keeps_the_lengths_and_the_volume_that_straight_lines_keep(shear: float) -> None:
    key1 = BOX @ np.array([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    frames = qc3d.bake([BOX, key1], BOX_FACES, 3).frames
    edges = unique_edges(sides(BOX_FACES))
    lengths = np.linalg.norm(frames[:, edges[:, 1]] - frames[:, edges[:, 0]], axis=2)
    ends = lengths[[0, -1]]
    beyond = np.maximum(lengths / ends.max(axis=0) - 1.0, 1.0 - lengths / ends.min(axis=0))
    assert beyond.max() < 0.0025
    volumes = [enclosed_volume(frame, BOX_FACES) for frame in frames]
    np.testing.assert_allclose(volumes, 1.0, rtol=0.005)
