# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Components that follow their own screw motions, and batches of least-squares rotations."""

from __future__ import annotations

import time as clock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.keys.embedding import RigidMotion
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.numerics.screws import best_turns, translation_factors
from qc3d_addon.solver.surface.anchors import ScrewAnchors

TIMES = (0.0, 0.2, 0.5, 1.0)


def anchors_of(key0: Floats, key1: Floats, labels: Ints, still: list[int] | None = None) -> ScrewAnchors:
    mask = np.zeros(len(key0), dtype=bool)
    mask[still or []] = True
    weights = np.random.default_rng(9).uniform(0.5, 1.0, len(key0))
    return ScrewAnchors(key0, key1, mask, weights, labels)


def random_twist(random: np.random.Generator, most: float = np.pi) -> tuple[Floats, Floats]:
    turn = random.normal(size=3)
    return turn * random.uniform(0.0, 0.95 * most) / np.linalg.norm(turn), random.normal(size=3)


@given(st.integers(0, 2**32 - 1))
def test_rigid_components_move_along_their_screws(seed: int) -> None:
    random = np.random.default_rng(seed)
    labels = random.permutation(np.repeat([0, 1, 2], [4, 5, 9]))
    key0 = random.normal(size=(18, 3))
    motions = [RigidMotion(*random_twist(random)) for _ in range(3)]
    anchors = anchors_of(key0, moved(key0, labels, motions, 1.0), labels)
    for time in TIMES:
        np.testing.assert_allclose(anchors.positions(time), moved(key0, labels, motions, time), rtol=0.0, atol=1e-9)


def moved(points: Floats, labels: Ints, motions: list[RigidMotion], time: float) -> Floats:
    result = points.copy()
    for label, motion in enumerate(motions):
        result[labels == label] = motion.apply(points[labels == label], time)
    return result


@given(st.integers(0, 2**32 - 1))
def test_both_keys_are_met(seed: int) -> None:
    random = np.random.default_rng(seed)
    key0, key1 = random.normal(size=(2, 20, 3))
    anchors = anchors_of(key0, key1, random.integers(0, 6, size=20))
    np.testing.assert_allclose(anchors.positions(0.0), key0, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(anchors.positions(1.0), key1, rtol=0.0, atol=1e-13)


def test_what_has_no_screw_goes_straight() -> None:
    random = np.random.default_rng(0)
    key0, key1 = random.normal(size=(2, 9, 3))
    # One with a still vertex, a pair, two on their own.
    anchors = anchors_of(key0, key1, np.array([0, 0, 0, 0, 0, 1, 1, 2, 3]), still=[2])
    for time in TIMES:
        np.testing.assert_allclose(anchors.positions(time), key0 + time * (key1 - key0), rtol=0.0, atol=1e-15)


def test_turns_that_are_told_and_others() -> None:
    random = np.random.default_rng(4)
    key0 = random.normal(size=(12, 3))
    labels = np.repeat([0, 1], 6)
    way = np.radians([[0.0, 0.0, 200.0]])
    key1 = key0 @ rotation_matrices(way)[0].T
    mask, weights = np.zeros(12, dtype=bool), np.ones(12)
    turns = np.concatenate([way, np.full((1, 3), np.nan)])
    middle = ScrewAnchors(key0, key1, mask, weights, labels, turns).positions(0.5)
    for part, angle in ((slice(0, 6), 100.0), (slice(6, 12), -80.0)):
        expected = key0[part] @ rotation_matrices(np.radians([[0.0, 0.0, angle]]))[0].T
        np.testing.assert_allclose(middle[part], expected, atol=1e-9)


def test_nothing_at_all() -> None:
    key = np.random.default_rng(0).normal(size=(6, 3))
    anchors = anchors_of(key, key, np.zeros(6, dtype=np.int64), still=list(range(6)))
    np.testing.assert_array_equal(anchors.positions(0.5), key)


@pytest.mark.parametrize("last", [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 3.0]])
def test_a_line_turns_no_further_than_it_must(last: list[float]) -> None:
    # A wire, a component squeezed into a point, and one squeezed onto a line: finite, and not spun about its axis.
    key0 = np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 3.0], 5)
    key1 = np.linspace([0.0, 0.0, 0.0], last, 5)
    positions = anchors_of(key0, key1, np.zeros(5, dtype=np.int64)).positions(0.5)
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    assert np.isfinite(positions).all()
    np.testing.assert_allclose(positions[:, 1], 0.0, rtol=0.0, atol=1e-12)
    if any(last):
        np.testing.assert_allclose(lengths, 0.75, rtol=1e-12)


def test_thousands_of_components_at_once() -> None:
    random = np.random.default_rng(1)
    labels = np.repeat(np.arange(3_000), 4)
    key0 = random.normal(size=(len(labels), 3))
    key1 = key0 @ rotation_matrices(np.array([[0.3, 0.9, -0.4]]))[0].T + [1.0, 2.0, 3.0]
    started = clock.process_time()
    anchors = anchors_of(key0, key1, labels)
    positions = anchors.positions(0.5)
    assert clock.process_time() - started < 1.0
    whole = RigidMotion.between(key0, key1, np.ones(len(key0)))
    np.testing.assert_allclose(positions, whole.apply(key0, 0.5), rtol=0.0, atol=1e-9)


class TestScrews:
    def test_best_turns_are_those_of_each_alone(self) -> None:
        random = np.random.default_rng(2)
        covariances = random.normal(size=(40, 3, 3))
        covariances[10:20] = random.normal(size=(10, 3, 1)) * random.normal(size=(10, 1, 3))
        covariances[20:25, :, 2] = 0.0
        covariances[25] = 0.0
        together = best_turns(covariances)
        assert np.isfinite(together).all()
        for turn, covariance in zip(together, covariances, strict=True):
            np.testing.assert_allclose(turn, best_turns(covariance[None])[0], rtol=0.0, atol=1e-9)

    @given(st.integers(0, 2**32 - 1))
    def test_no_other_rotation_fits_better(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        covariance = random.normal(size=(3, 3)) * [1.0, 1.0, random.integers(0, 2)]
        fit = np.einsum("ij,ij->", rotation_matrices(best_turns(covariance[None]))[0], covariance)
        others = rotation_matrices(random.normal(scale=2.0, size=(200, 3)))
        assert np.einsum("kij,ij->k", others, covariance).max() <= fit + 1e-9

    @pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 1e-3, 1.0, 3.0, 7.0])
    def test_the_end_of_a_twist(self, angle: float) -> None:
        axis, velocity = np.array([0.48, -0.6, 0.64]), np.array([1.0, 2.0, -3.0])
        twist = np.zeros((4, 4))
        twist[:3, :3] = angle * np.cross(axis, np.eye(3)).T
        twist[:3, 3] = velocity
        exact = expm(twist)
        turn = angle * axis
        np.testing.assert_allclose(rotation_matrices(turn[None])[0], exact[:3, :3], rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(translation_factors(turn[None])[0] @ velocity, exact[:3, 3], rtol=0.0, atol=1e-12)
