# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys that are the pose of one joint are recognized as that and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.combinations.joint_poses import JointPose
from qc3d_addon.solver.numerics.rotations import rotation_matrices

from .arm import arm, posed

REST, FACES = arm(21, 10)
SIZE = float(np.linalg.norm(np.ptp(REST, axis=0)))


def _skinned(weights: Floats, turn: Floats, pivot: Floats, slide: float, share: float = 1.0) -> Floats:
    """The arm with a joint turned by a share of a rotation vector and slid along its axis."""
    axis = turn / np.linalg.norm(turn)
    moved = (REST - pivot) @ rotation_matrices(share * turn[None])[0].T + pivot + share * slide * axis
    return np.asarray(REST + weights[:, None] * (moved - REST))


@pytest.mark.parametrize("seed", range(12))
def test_any_joint_with_any_weights_is_found_at_every_angle(seed: int) -> None:
    random = np.random.default_rng(seed)
    joint, breadth = random.uniform(0.8, 3.0), random.uniform(0.2, 0.6)
    weights = np.clip((REST[:, 0] - joint) / breadth + random.uniform(-0.2, 0.2, len(REST)), 0.0, 1.0)
    axis = random.standard_normal(3)
    turn = axis / np.linalg.norm(axis) * np.radians(random.uniform(10.0, 165.0))
    pivot, slide = np.array([joint, *random.uniform(-0.2, 0.2, 2)]), random.uniform(-0.3, 0.3)
    key = _skinned(weights, turn, pivot, slide)
    if seed % 2:
        key = key.astype(np.float32).astype(np.float64)  # as Blender stores it
    pose = JointPose.found(REST, key, FACES)
    assert pose is not None
    np.testing.assert_allclose(pose.turn, turn, atol=1e-5)
    for share in (0.0, 0.3, 0.5, 1.0):
        away = np.linalg.norm(pose.at(share) - _skinned(weights, turn, pivot, slide, share), axis=1).max()
        assert away < 1e-6 * SIZE
    np.testing.assert_allclose(pose.at(1.0), key, rtol=0.0, atol=1e-14 * SIZE)


def _bumped(key: Floats) -> Floats:
    bump = np.exp(-((REST - [2.0, 0.3, 0.0]) ** 2).sum(axis=1) / 0.02)
    return np.asarray(key + 0.01 * bump[:, None] * [0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    "key",
    [
        REST,
        REST + [1.0, 0.0, 0.0],
        REST * [1.2, 1.0, 1.0],
        posed(REST, 60.0, 40.0),
        posed(REST, 60.0, 0.0) + 1e-4 * np.random.default_rng(0).standard_normal(REST.shape),
        _bumped(posed(REST, 60.0, 0.0)),
        posed(REST, 3.0, 0.0),
        posed(REST, 176.0, 0.0),
    ],
    ids=["base", "moved", "stretched", "two joints", "noise", "sculpted", "hardly turned", "half a turn"],
)
def test_nothing_else_is_one(key: Floats) -> None:
    assert JointPose.found(REST, key, FACES) is None
