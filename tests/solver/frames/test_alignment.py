# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames stand where their calm parts go straight, gradually in time and in the keys, in chains without a jerk."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.frames.alignment import CalmAlignment, RigidMove
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.surface.path import SurfacePath

from ..baking import frames_of
from ..meshes import bent, box_surface

pytestmark = pytest.mark.usefixtures("coarse_volume")

BAR, FACES = box_surface((2, 2, 12), (1.0, 1.0, 5.0))
RANDOM = np.random.default_rng(4)
CLOUD = RANDOM.normal(size=(40, 3))
WEIGHTS = np.full(40, 1.0 / 40.0)


def swinging(angle: float) -> np.ndarray:
    """A bar whose upper half bends far, while all of it moves a little."""
    moved = BAR + np.array([0.02, 0.03, 0.01])
    upper = BAR[:, 2] > 2.5
    moved[upper] = bent(BAR, angle)[upper] - bent(BAR, angle)[np.argmin(np.abs(BAR[:, 2] - 2.5))]
    moved[upper] += moved[~upper].mean(axis=0) + np.array([0.0, 0.0, 1.5])
    return moved


class TestPlacement:
    def test_finds_a_small_rigid_motion(self) -> None:
        turn, shift = np.array([0.05, -0.08, 0.03]), np.array([0.2, 0.1, -0.3])
        target = CLOUD @ rotation_matrices(turn[None])[0].T + shift
        found = RigidMove.between(CLOUD, target, WEIGHTS)
        np.testing.assert_allclose(found.apply(CLOUD), target, rtol=0.0, atol=1e-6)
        vectors = found.apply(CLOUD[1:]) - found.apply(CLOUD[:1])
        np.testing.assert_allclose(found.undo_vectors(vectors), CLOUD[1:] - CLOUD[:1], rtol=0.0, atol=1e-12)

    @pytest.mark.parametrize("target", [np.zeros_like(CLOUD), -CLOUD, 1e-9 * CLOUD])
    def test_turns_nothing_toward_what_is_flattened_or_reversed(self, target: np.ndarray) -> None:
        assert np.linalg.norm(RigidMove.between(CLOUD, target, WEIGHTS).turn) < 1e-6

    @pytest.mark.parametrize("points", [np.outer(CLOUD[:, 0], [1.0, 2.0, 3.0]), np.zeros_like(CLOUD)])
    def test_points_in_a_line_or_in_one_place(self, points: np.ndarray) -> None:
        found = RigidMove.between(points, points + 1.0, WEIGHTS)
        np.testing.assert_allclose(found.apply(points), points + 1.0, rtol=0.0, atol=1e-9)

    def test_still_vertices_hold_the_rest(self) -> None:
        key1 = BAR + np.array([0.3, 0.0, 0.0]) * BAR[:, 2:]
        key1[:9] = BAR[:9]
        embedding = Embedding.of(KeyPair.checked(BAR, key1, FACES))
        drifted = embedding.straight(0.5) @ rotation_matrices(np.array([[0.0, 0.02, 0.0]]))[0].T + 0.01
        placed = CalmAlignment(embedding, SurfacePath(embedding)).of(drifted, 0.5).apply(drifted)
        still, line = embedding.still, embedding.straight(0.5)
        np.testing.assert_allclose(placed[still], line[still], rtol=0.0, atol=1e-6)


def test_calm_parts_go_straight_where_nothing_is_still() -> None:
    key1 = swinging(1.2)
    fitted = finish(fit_pair(KeyPair.checked(BAR, key1, FACES), FitOptions()))
    times = [0.0, 0.25, 0.5, 0.75, 1.0]
    frames = frames_of(fitted, times).frames
    calm = np.argsort(np.linalg.norm(key1 - BAR, axis=1))[: len(BAR) // 10]
    straight = np.stack([(1.0 - time) * BAR + time * key1 for time in times])
    off = np.linalg.norm(frames - straight, axis=2)
    assert off[:, calm].max() < 0.004 * fitted.pair.diagonal
    assert off.max() > 0.02 * fitted.pair.diagonal


def test_a_chain_has_one_velocity_at_its_inner_key() -> None:
    keys = [BAR, swinging(1.0), swinging(-0.6)]
    fits = [
        finish(fit_pair(KeyPair.checked(first, second, FACES), FitOptions()))
        for first, second in pairwise(keys)
    ]
    step = 1e-3
    before, key, after = frames_of(fits, [0.5 - step, 0.5, 0.5 + step]).frames
    speed = np.linalg.norm(after - before, axis=1).max() / (2.0 * step)
    assert np.linalg.norm(after - 2.0 * key + before, axis=1).max() / step < 0.06 * speed


@pytest.mark.parametrize("angle", [120.0, 180.0])
def test_a_page_about_its_still_spine_turns_evenly(angle: float) -> None:
    """What is calm there turns as far as the rest: straight lines do not tell how far it is at a time."""
    page, faces = box_surface((6, 4, 1), (1.0, 1.0, 0.01))
    page = page - [page[:, 0].min(), 0.0, 0.005]
    page[page[:, 0] == 0.0, 2] = 0.0
    turned = page @ rotation_matrices(np.radians([[0.0, -angle, 0.0]]))[0].T
    turned[page[:, 0] == 0.0] = page[page[:, 0] == 0.0]
    fitted = finish(fit_pair(KeyPair.checked(page, turned, faces), FitOptions()))
    frames = frames_of(fitted, [0.25, 0.5, 0.75]).frames
    outer = page[:, 0] > 0.99
    angles = np.degrees(np.arctan2(frames[:, outer, 2].mean(axis=1), frames[:, outer, 0].mean(axis=1)))
    # Half a turn may go either way.
    np.testing.assert_allclose(np.abs(angles), angle * np.array([0.25, 0.5, 0.75]), rtol=0.0, atol=1.0)
