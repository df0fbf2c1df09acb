# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose parts that lie close to each other in both keys stay together on the way."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.surface.joints import Joints
from qc3d_addon.solver.surface.path import SurfacePath

from ..meshes import box_surface

BONE, BONE_FACES = box_surface((2, 2, 6), (0.2, 0.2, 1.0))
COUNT = len(BONE)


def turned(points: Floats, degrees: float) -> Floats:
    return np.asarray(points @ rotation_matrices(np.radians([[0.0, degrees, 0.0]]))[0].T)


def arm(shoulder: float, elbow: float, gap: float = 0.02) -> Floats:
    """An upper arm that turns about the origin, and a loose forearm that turns about the other's end as well."""
    forearm = turned(BONE, elbow) + [0.0, 0.0, 1.0 + gap]
    return turned(np.concatenate([BONE, forearm]), shoulder)


def joints_of(key0: Floats, key1: Floats, turns: list[float], still: Ints | None = None) -> Joints:
    rests = np.zeros(2 * COUNT, dtype=bool)
    rests[np.empty(0, dtype=np.int64) if still is None else still] = True
    labels = np.repeat([0, 1], COUNT)
    vectors = np.radians([[0.0, turn, 0.0] for turn in turns])
    return Joints(key0, key1, rests, np.ones(2 * COUNT), labels, vectors)


def gap_of(shape: Floats) -> float:
    """Distance between the middles of the ends that form the elbow."""
    end, start = BONE[:, 2] == 1.0, BONE[:, 2] == 0.0
    return float(np.linalg.norm(shape[:COUNT][end].mean(axis=0) - shape[COUNT:][start].mean(axis=0)))


@pytest.mark.parametrize("still", [False, True])
def test_an_elbow_of_two_loose_bones_stays_closed(still: bool) -> None:
    key0, key1 = arm(0.0, 0.0), arm(70.0, 80.0)
    faces = np.concatenate([BONE_FACES, BONE_FACES + COUNT])
    if still:  # a third bone, out of reach: nothing is taken out of the whole
        key0, key1 = (np.concatenate([key, BONE + 9.0]) for key in (key0, key1))
        faces = np.concatenate([faces, BONE_FACES + 2 * COUNT])
    embedding = Embedding.of(KeyPair.checked(key0, key1, faces))
    path = SurfacePath(embedding)
    for time in (0.25, 0.5, 0.75):
        shape = embedding.from_cube(path.positions(time), time)
        assert gap_of(shape[: 2 * COUNT]) < 0.05
    for time, key in ((0.0, key0), (1.0, key1)):
        np.testing.assert_allclose(embedding.from_cube(path.positions(time), time), key, atol=1e-9)


def test_what_is_apart_in_a_key_has_no_joint() -> None:
    key0, key1 = arm(0.0, 0.0), arm(0.0, 0.0, gap=0.5)
    shape = 0.5 * (key0 + key1)
    assert joints_of(key0, key1, [0.0, 0.0]).closed(shape, 0.5) is shape
    assert joints_of(key1, key0, [0.0, 0.0]).closed(shape, 0.5) is shape


def test_what_rests_keeps_its_place_and_the_other_one_follows() -> None:
    key0, key1 = arm(0.0, 0.0), arm(0.0, 60.0)
    pulled = arm(0.0, 30.0) + np.repeat([[0.0, 0.0, 0.0], [0.3, 0.0, 0.1]], COUNT, axis=0)
    closed = joints_of(key0, key1, [0.0, 60.0], still=np.arange(3)).closed(pulled, 0.5)
    assert np.array_equal(closed[:COUNT], pulled[:COUNT])
    assert gap_of(closed) < 0.05 < 0.2 < gap_of(pulled)
    moves = closed[COUNT:] - pulled[COUNT:]
    np.testing.assert_allclose(moves, np.broadcast_to(moves[:1], moves.shape), atol=1e-12)
    both = joints_of(key0, key1, [0.0, 60.0], still=np.array([0, COUNT]))
    assert both.closed(pulled, 0.5) is pulled


def test_what_turns_as_one_is_left_alone() -> None:
    """Offsets turn with what they belong to, so a rigid motion of the whole has no open joints."""
    key0, key1 = arm(0.0, 20.0), arm(140.0, 20.0)
    shape = arm(70.0, 20.0)
    np.testing.assert_allclose(joints_of(key0, key1, [140.0, 140.0]).closed(shape, 0.5), shape, atol=1e-12)


def test_by_degrees() -> None:
    """A joint sets in gradually with the distance of the parts."""
    pulled = arm(0.0, 30.0) + np.repeat([[0.0, 0.0, 0.0], [0.3, 0.0, 0.1]], COUNT, axis=0)
    found = [
        joints_of(arm(0.0, 0.0, gap), arm(0.0, 60.0, gap), [0.0, 60.0], still=np.arange(3)).closed(pulled, 0.5)
        for gap in np.linspace(0.0, 0.15, 300)
    ]
    steps = [np.abs(second - first).max() for first, second in itertools.pairwise(found)]
    assert np.abs(found[-1] - found[0]).max() > 0.2
    assert max(steps) < 0.02
