# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices that no fold-free map can meet, also deep inside other parts, where no triangles cross."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Bools, Floats, Ints
from qc3d_addon.solver.fit.own_crossings import crossing_vertices
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair

from ..meshes import icosphere
from .test_meeting import bar


def crossing(key0: Floats, key1: Floats, faces: Ints) -> Bools:
    return crossing_vertices(Embedding.of(KeyPair.checked(key0, key1, faces)))


def two_balls(small: tuple[Floats, Ints], offset: float) -> tuple[Floats, Ints]:
    """A ball of radius 1, and a small one whose center is off by so much."""
    large, faces = icosphere(2, 1.0)
    return np.concatenate([large, small[0] + [offset, 0.0, 0.0]]), np.concatenate([faces, small[1] + len(large)])


@pytest.mark.parametrize(("before", "after", "marked"), [(2.0, 0.1, True), (0.1, 2.0, True), (0.1, 0.2, False)])
def test_a_ball_inside_another(before: float, after: float, marked: bool) -> None:
    small = icosphere(1, 0.2)
    (key0, faces), (key1, _) = two_balls(small, before), two_balls(small, after)
    found = crossing(key0, key1, faces)
    count = len(small[0])
    # In the other ball in one key only: no map takes it there. Inside it in both keys is no crossing.
    assert found[-count:].all() == found[-count:].any() == marked
    assert not found[:-count].any()


def test_a_ball_within_a_ball_that_is_open_may_have_come_through_the_hole() -> None:
    small = icosphere(1, 0.2)
    (key0, faces), (key1, _) = two_balls(small, 2.0), two_balls(small, 0.1)
    assert not crossing(key0, key1, faces[1:]).any()


def horn(length: float) -> Floats:
    """The bar, thinner towards its end and bent to a circle; with a length of more than 1, the end is in its base."""
    points, _ = bar()
    x, y, z = points[:, 0] - 0.5, points[:, 1] - 0.5, points[:, 2] / 4.0
    radius, thick = 2.0, 1.0 - 0.9 * z
    angle = 2.0 * np.pi * length * z
    return np.stack([(radius + thick * x) * np.cos(angle), thick * y, (radius + thick * x) * np.sin(angle)], axis=1)


def test_the_end_of_a_horn_that_is_inside_its_own_base() -> None:
    points, faces = bar()
    found = crossing(horn(0.5), horn(1.1), faces)
    # The inside of the cap at its end is not beside triangles that cross.
    cap = (points[:, 2] == 4.0) & (np.abs(points[:, :2] - 0.5) < 0.4).all(axis=1)
    assert cap.sum() == 9
    assert found[cap].all()
    assert not found[(points[:, 2] > 1.0) & (points[:, 2] < 3.0)].any()
    assert not crossing(horn(0.5), horn(0.9), faces).any()
    # As with normals that point inward.
    np.testing.assert_array_equal(crossing(horn(0.5), horn(1.1), faces[:, ::-1]), found)


def test_seams_count_on_both_sides() -> None:
    small = icosphere(1, 0.2)
    (key0, faces), (key1, _) = two_balls(small, 2.0), two_balls(small, 0.1)
    apart = np.arange(3 * len(faces)).reshape(-1, 3)  # every triangle has vertices of its own
    found = crossing(key0[faces.ravel()], key1[faces.ravel()], apart)
    np.testing.assert_array_equal(found, crossing(key0, key1, faces)[faces.ravel()])
