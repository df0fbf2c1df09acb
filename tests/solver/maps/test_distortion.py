# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of distortion: known answers, invariances, and folds."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.maps.distortion import (
    TriangleStretches,
    dilatation,
    extreme_stretch,
    inner_dilatation,
    outer_dilatation,
    singular_values,
    volume_ratio,
)
from qc3d_addon.solver.numerics.rotations import rotation_matrices

from ..meshes import icosphere

sizes = st.tuples(*[st.floats(0.05, 20.0)] * 3)
turns = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


def rotation(turn: tuple[float, ...]) -> Floats:
    return rotation_matrices(np.array([turn]))


@given(sizes, turns, turns)
def test_the_measures_of_known_stretches(
    stretches: tuple[float, ...], left: tuple[float, ...], right: tuple[float, ...]
) -> None:
    a, b, c = sorted(stretches, reverse=True)
    values = singular_values(rotation(left) @ np.diag([c, a, b]) @ rotation(right))
    np.testing.assert_allclose(values, [[a, b, c]], rtol=1e-12)
    np.testing.assert_allclose(volume_ratio(values), a * b * c, rtol=1e-12)
    np.testing.assert_allclose(dilatation(values), a / c, rtol=1e-10)
    np.testing.assert_allclose(outer_dilatation(values), a**3 / (a * b * c), rtol=1e-10)
    np.testing.assert_allclose(inner_dilatation(values), a * b * c / c**3, rtol=1e-10)
    largest = max(outer_dilatation(values)[0], inner_dilatation(values)[0])
    assert a / c * (1.0 - 1e-9) <= largest <= (a / c) ** 2 * (1.0 + 1e-9)


def test_folds_have_a_negative_volume_and_no_finite_dilatation() -> None:
    values = singular_values(np.stack([np.diag([2.0, 1.0, -0.5]), np.diag([1.0, 1.0, 0.0]), -np.eye(3)]))
    np.testing.assert_allclose(volume_ratio(values), [-1.0, 0.0, -1.0], atol=1e-15)
    for measure in (dilatation, outer_dilatation, inner_dilatation):
        assert np.isinf(measure(values)).all()


@given(st.floats(0.2, 5.0), st.floats(0.2, 5.0), turns)
def test_stretches_of_triangles_do_not_feel_how_they_turn(along: float, across: float, turn: tuple[float, ...]) -> None:
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.8, 0.0], [1.2, 0.9, 0.0]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    stretched = flat * [along, across, 1.0] @ rotation(turn)[0].T
    found = TriangleStretches(flat, faces).of(stretched)
    expected = [max(along, across), min(along, across)]
    np.testing.assert_allclose(found, [expected, expected], rtol=1e-10)


def test_a_similarity_stretches_a_sphere_evenly() -> None:
    points, faces = icosphere(1)
    np.testing.assert_allclose(TriangleStretches(points, faces).of(3.0 * points), 3.0, rtol=1e-12)


def test_a_triangle_without_an_area_has_no_stretch() -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    found = TriangleStretches(points, np.array([[0, 1, 2], [0, 1, 3]])).of(2.0 * points)
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1], 2.0)


def test_the_extreme_is_the_one_farther_from_one() -> None:
    np.testing.assert_array_equal(
        extreme_stretch(np.array([[2.0, 0.9], [1.1, 0.5], [1.0, 1.0], [4.0, 0.25], [1.5, 0.0]])),
        [2.0, 0.5, 1.0, 4.0, 0.0],
    )
