# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotation and stretch of triangles, for maps whose rotation and stretch are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.numerics.assembly import gradient_operator
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import StretchLaw
from qc3d_addon.solver.surface.tangents import closest_tangents, stretched, tangents_of
from qc3d_addon.solver.triangles.deformation import TriangleDeformation
from qc3d_addon.solver.triangles.geometry import face_normals, hat_gradients, tangent_bases

from ..meshes import enclosed_volume, icosphere, twisted

BALL, FACES = icosphere(1)
# Half of the way to three times the size.
LAWS: dict[StretchLaw, float] = {"linear": 2.0, "logarithmic": 3.0**0.5}


def deformation_gradients(deformation: TriangleDeformation, key1: Floats) -> Floats:
    """(m, 3, 2) in space, from the tangent bases of the first key."""
    return np.asarray(np.einsum("mki,mkj->mij", key1[deformation.faces], deformation.gradients))


@given(st.integers(0, 2**32 - 1))
def test_a_rotation_is_a_rotation_without_stretch(seed: int) -> None:
    turn = Rotation.random(random_state=seed)
    moved = BALL @ turn.as_matrix().T + [1.0, 2.0, 3.0]
    deformation = TriangleDeformation.between(BALL, moved, FACES)
    expected = np.broadcast_to(turn.as_matrix(), (len(FACES), 3, 3))
    np.testing.assert_allclose(rotation_matrices(deformation.turns), expected, rtol=0.0, atol=1e-12)
    stretch = deformation.stretch.at(1.0, "linear")
    np.testing.assert_allclose(stretch, np.broadcast_to(np.eye(2), stretch.shape), rtol=0.0, atol=1e-12)


def test_a_scaling_is_a_stretch_without_rotation() -> None:
    deformation = TriangleDeformation.between(BALL, 3.0 * BALL, FACES)
    np.testing.assert_allclose(deformation.turns, 0.0, rtol=0.0, atol=1e-12)
    for law, factor in LAWS.items():
        halfway = deformation.stretch.at(0.5, law)
        np.testing.assert_allclose(halfway, factor * np.broadcast_to(np.eye(2), halfway.shape), rtol=0.0, atol=1e-12)


def test_rotation_and_stretch_make_the_deformation() -> None:
    key1 = twisted(BALL, 1.5) * [1.0, 0.8, 1.4]
    deformation = TriangleDeformation.between(BALL, key1, FACES)
    made = rotation_matrices(deformation.turns) @ deformation.bases[:, :, :2] @ deformation.stretch.at(1.0, "linear")
    np.testing.assert_allclose(made, deformation_gradients(deformation, key1), rtol=0.0, atol=1e-12)


def test_normals_are_turned_onto_normals() -> None:
    key1 = twisted(BALL, 1.5) * [1.0, 0.8, 1.4]
    deformation = TriangleDeformation.between(BALL, key1, FACES)
    normals0, normals1 = (tangent_bases(key, FACES)[:, :, 2] for key in (BALL, key1))
    turned = np.einsum("mij,mj->mi", rotation_matrices(deformation.turns), normals0)
    np.testing.assert_allclose(turned, normals1, rtol=0.0, atol=1e-12)


def test_hat_gradients_take_linear_functions_apart() -> None:
    bases = tangent_bases(BALL, FACES)
    gradients = hat_gradients(BALL, FACES, bases)
    np.testing.assert_allclose(gradients.sum(axis=1), 0.0, rtol=0.0, atol=1e-12)
    slope = np.array([1.0, -2.0, 0.5])
    found = np.einsum("mk,mki->mi", (BALL @ slope)[FACES], gradients)
    np.testing.assert_allclose(found, np.einsum("i,mij->mj", slope, bases[:, :, :2]), rtol=0.0, atol=1e-12)


def test_bases_are_right_handed_and_orthonormal() -> None:
    bases = tangent_bases(BALL, FACES)
    squares = bases.transpose(0, 2, 1) @ bases
    np.testing.assert_allclose(squares, np.broadcast_to(np.eye(3), squares.shape), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(bases), 1.0, rtol=0.0, atol=1e-14)
    # Normals of the ball point out.
    assert (np.einsum("mi,mi->m", bases[:, :, 2], BALL[FACES].mean(axis=1) - 0.5) > 0.0).all()


def test_face_normals_are_twice_the_areas() -> None:
    normals = face_normals(BALL, FACES)
    np.testing.assert_allclose(normals.sum(axis=0), 0.0, rtol=0.0, atol=1e-14)
    volume = np.einsum("mi,mi->", normals, BALL[FACES].mean(axis=1)) / 6.0
    assert volume == pytest.approx(enclosed_volume(BALL, FACES), rel=1e-12)


def test_triangles_without_an_area_in_either_key_are_left_out() -> None:
    key1 = BALL.copy()
    key1[FACES[7, 0]] = key1[FACES[7, 1]]
    faces = np.concatenate([FACES, [[0, 0, 1], [3, 3, 3]]])
    deformation = TriangleDeformation.between(BALL, key1, faces)
    collapsed = np.isin(FACES, FACES[7, :2]).sum(axis=1) == 2
    np.testing.assert_array_equal(deformation.faces, FACES[~collapsed])
    assert np.isfinite(deformation.turns).all()


@given(st.integers(0, 2**32 - 1))
def test_closest_tangents_are_the_polar_factor(seed: int) -> None:
    random = np.random.default_rng(seed)
    vectors, lengths = random.normal(size=(3, 2, 30)), random.uniform(0.5, 2.0, 30)
    left, _, right = np.linalg.svd(vectors.transpose(2, 0, 1), full_matrices=False)
    polar = left @ right
    np.testing.assert_allclose(closest_tangents(vectors).transpose(2, 0, 1), polar, rtol=0.0, atol=1e-9)
    longer = closest_tangents(vectors, lengths).transpose(2, 0, 1)
    np.testing.assert_allclose(longer, lengths[:, None, None] * polar, rtol=0.0, atol=1e-9)


def test_closest_tangents_of_lines_and_points_are_finite() -> None:
    line = np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [1e-200, 0.0, 0.0]])
    assert np.isfinite(closest_tangents(np.stack([line, -2.0 * line], axis=1))).all()


def test_tangents_of_turned_positions_are_turned_tangents() -> None:
    turn = Rotation.random(random_state=1).as_matrix()
    deformation = TriangleDeformation.between(BALL, 1.5 * BALL, FACES)
    gradient = gradient_operator(deformation.faces, deformation.gradients, len(BALL))
    gradients = np.stack([gradient @ row for row in turn @ BALL.T]).reshape(3, 2, -1)
    fitted = closest_tangents(stretched(deformation.stretch.at(0.3, "linear"), gradients))
    turns = np.broadcast_to(turn, (len(deformation.faces), 3, 3))
    np.testing.assert_allclose(fitted, tangents_of(turns, deformation.bases[:, :, :2]), rtol=0.0, atol=1e-12)


def test_stretched_vectors_are_products() -> None:
    vectors = np.random.default_rng(0).normal(size=(3, 2, 8))
    stretch = np.random.default_rng(1).normal(size=(8, 2, 2))
    stretch += stretch.transpose(0, 2, 1)
    expected = np.einsum("mij,kjm->kim", stretch, vectors)
    np.testing.assert_allclose(stretched(stretch, vectors), expected, rtol=0.0, atol=1e-14)
