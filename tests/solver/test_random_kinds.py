# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Random meshes of the kinds that people have: never worse than the straight blend, rigid, symmetric, and moved along.

Each kind is a pair of keys from a seed. What holds of all is tested of all; ``python -m pytest`` takes the same seeds
every time, other ones are tried by changing ``SEEDS``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision.self_crossings import PairCrossings
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.triangles.topology import sides, unique_edges

from .meshes import bent, box_surface, icosphere, sheet

pytestmark = [pytest.mark.usefixtures("coarse_volume"), pytest.mark.slow]

SEEDS = (1, 2)
VISIBLE = 0.0025  # of an edge's length
Keys = tuple[Floats, Floats, Ints]


def curled(points: Floats, curvature: float) -> Floats:
    angle = curvature * points[:, 0]
    return np.stack([np.sin(angle), curvature * points[:, 1], 1.0 - np.cos(angle)], axis=1) / curvature


def pages(random: np.random.Generator) -> Keys:
    """A sheet that is curled one way, then the other."""
    points, faces = sheet((14, 6), (2.0, 1.0))
    curvature = random.uniform(0.5, 2.0)
    return curled(points, curvature), curled(points, -curvature), faces


def folds(random: np.random.Generator) -> Keys:
    points, faces = sheet((10, 6), (2.0, 1.0))
    angle, beyond = random.uniform(1.0, 2.9), np.maximum(points[:, 0] - 1.0, 0.0)
    folded = np.minimum(points[:, 0], 1.0) + beyond * np.cos(angle)
    return points, np.stack([folded, points[:, 1], beyond * np.sin(angle)], axis=1), faces


def flags(random: np.random.Generator) -> Keys:
    points, faces = sheet((12, 8), (1.5, 1.0))
    keys = []
    for _ in range(2):
        waves, phases = random.normal(scale=3.0, size=(3, 2)), random.uniform(0.0, 6.0, 3)
        raised = 0.12 * points[:, 0] * np.sin(points[:, :2] @ waves.T + phases).sum(axis=1)
        keys.append(points + raised[:, None] * [0.0, 0.0, 1.0])
    return keys[0], keys[1], faces


def blocks(random: np.random.Generator) -> Keys:
    """Twelve bricks that are thrown apart, each turning its own way."""
    brick, faces = box_surface((1, 1, 1), (0.3, 0.2, 0.4))
    places = np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0, 2.0]), axis=-1).reshape(-1, 1, 3)
    turns, middle = rotation_matrices(random.normal(scale=0.6, size=(12, 3))), brick.mean(axis=0)
    thrown = (brick - middle) @ turns.transpose(0, 2, 1) + middle + 1.3 * places + 0.1 * random.normal(size=(12, 1, 3))
    every = (faces + len(brick) * np.arange(12)[:, None, None]).reshape(-1, 3)
    return (brick + places).reshape(-1, 3), thrown.reshape(-1, 3), every


def masks(random: np.random.Generator) -> Keys:
    """A ball that bulges alike on both sides of the plane x = 0."""
    points, faces = icosphere(2, 1.0)
    points = points - 0.5
    waves = np.sin(2.0 * np.abs(points) @ random.normal(size=(3, 2)) + points[:, 1:2] + random.uniform(0.0, 6.0, 2))
    moved = points * np.stack([1.0 + 0.4 * waves[:, 0], np.ones(len(points)), np.ones(len(points))], axis=1)
    return points, moved + np.outer(waves[:, 1], [0.0, 0.2, 0.15]), faces


def tubes(random: np.random.Generator) -> Keys:
    points, faces = box_surface((3, 3, 12), (0.6, 0.6, 4.0))
    return points, bent(points, random.uniform(1.0, 3.0)), faces


KINDS: dict[str, Callable[[np.random.Generator], Keys]] = {
    "pages": pages, "folds": folds, "flags": flags, "blocks": blocks, "masks": masks, "tubes": tubes
}  # fmt: skip


def edge_excess(frames: Floats, keys: Floats, edges: Ints) -> float:
    """How far edges leave the interval between their key lengths: the worst frame's 99th percentile."""
    lengths, ends = (np.linalg.norm(np.diff(each[:, edges], axis=2)[:, :, 0], axis=2) for each in (frames, keys))
    beyond = np.maximum(lengths / ends.max(axis=0) - 1.0, 1.0 - lengths / ends.min(axis=0))
    return float(np.percentile(np.maximum(beyond, 0.0), 99, axis=1).max())


def rigid_misfit(source: Floats, target: Floats) -> float:
    """Distance of a shape from the nearest copy of another one that is only moved and turned."""
    spread, other = source - source.mean(axis=0), target - target.mean(axis=0)
    left, _, right = np.linalg.svd(spread.T @ other)
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    return float(np.linalg.norm(spread @ turn - other, axis=1).max())


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_random_one(kind: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    key0, key1, faces = KINDS[kind](random)
    size, keys = float(np.linalg.norm(np.ptp(key0, axis=0))), np.stack([key0, key1])
    bake = qc3d.bake([key0, key1], faces, 3)
    straight = key0 + bake.times[:, None, None] * (key1 - key0)

    edges = unique_edges(sides(faces))
    assert edge_excess(bake.frames, keys, edges) <= edge_excess(straight, keys, edges) + VISIBLE
    counts = PairCrossings(KeyPair.checked(key0, key1, faces))
    for frame, line in zip(bake.frames, straight, strict=True):
        assert (counts.excess(frame) or 0) <= (counts.excess(line) or 0)

    if kind == "blocks":
        for block in range(12):
            own = slice(8 * block, 8 * block + 8)
            assert max(rigid_misfit(key0[own], frame[own]) for frame in bake.frames) < 1e-9 * size
    if kind == "masks":
        mirrored = key0 * [-1.0, 1.0, 1.0]
        partners = np.argmin(np.linalg.norm(key0[:, None] - mirrored, axis=2), axis=1)
        assert np.abs(bake.frames[:, partners] * [-1.0, 1.0, 1.0] - bake.frames).max() < 1e-9 * size

    turn, scale, shift = rotation_matrices(random.normal(size=(1, 3)))[0], 1.7, random.normal(size=3)
    moved = qc3d.bake([scale * key @ turn.T + shift for key in keys], faces, 3).frames
    expected = scale * bake.frames @ turn.T + shift
    np.testing.assert_allclose(moved, expected, rtol=0.0, atol=1e-9 * scale * size)
