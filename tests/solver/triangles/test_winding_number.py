# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Winding numbers against exact solid angles: closed, open, nested, reversed and degenerate surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.triangles import winding_number
from qc3d_addon.solver.triangles.geometry import face_normals
from qc3d_addon.solver.triangles.winding_number import exact_winding_numbers, winding_numbers

from ..meshes import box_surface, icosphere

BALL, BALL_FACES = icosphere(3)
CENTER = np.full(3, 0.5)
# Softened dipoles count a little less than their triangles within a few times their size.
NEAR = 0.05


def solid_angles(points: Floats, faces: Ints, queries: Floats) -> Floats:
    """Winding numbers as sums of the exact solid angles of the triangles (Van Oosterom & Strackee 1983)."""
    total = np.zeros(len(queries))
    for index, query in enumerate(queries):
        a, b, c = (points[faces[:, corner]] - query for corner in range(3))
        lengths = [np.linalg.norm(side, axis=1) for side in (a, b, c)]
        above = np.einsum("ij,ij->i", a, np.cross(b, c))
        below = lengths[0] * lengths[1] * lengths[2]
        for (one, other), length in zip(((a, b), (b, c), (c, a)), (lengths[2], lengths[0], lengths[1]), strict=True):
            below = below + np.einsum("ij,ij->i", one, other) * length
        total[index] = 2.0 * np.arctan2(above, below).sum()
    return total / (4.0 * np.pi)


def directions(count: int) -> Floats:
    """Random unit vectors."""
    vectors = np.random.default_rng(0).normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def at_radius(radius: float, count: int = 100) -> Floats:
    return CENTER + radius * directions(count)


def test_one_inside_and_zero_outside_a_sphere() -> None:
    for radius in (0.0, 0.1, 0.2, 0.25):
        np.testing.assert_allclose(winding_numbers(BALL, BALL_FACES, at_radius(radius)), 1.0, rtol=0.0, atol=NEAR)
    for radius in (0.35, 0.5, 2.0):
        np.testing.assert_allclose(winding_numbers(BALL, BALL_FACES, at_radius(radius)), 0.0, rtol=0.0, atol=NEAR)


def test_from_one_to_zero_through_the_surface() -> None:
    means = [winding_numbers(BALL, BALL_FACES, at_radius(radius)).mean() for radius in np.linspace(0.2, 0.4, 9)]
    assert (np.diff(means) < 1e-3).all()
    assert means[4] == pytest.approx(0.5, abs=0.1)


def test_reversed_faces_wind_the_other_way() -> None:
    inside = winding_numbers(BALL, BALL_FACES[:, ::-1], at_radius(0.1))
    np.testing.assert_allclose(inside, -winding_numbers(BALL, BALL_FACES, at_radius(0.1)), rtol=0.0, atol=1e-12)


def test_half_at_the_center_of_an_open_hemisphere() -> None:
    upper = BALL_FACES[(BALL[BALL_FACES, 2] >= 0.5 - 1e-9).all(axis=1)]
    rim = solid_angles(BALL, upper, CENTER[None])[0]
    assert rim == pytest.approx(0.5, abs=0.06)
    assert winding_numbers(BALL, upper, CENTER[None])[0] == pytest.approx(rim, abs=0.01)


def test_nested_spheres_add_up() -> None:
    nested = np.concatenate([BALL, CENTER + 0.4 * (BALL - CENTER)])
    faces = np.concatenate([BALL_FACES, BALL_FACES + len(BALL)])
    np.testing.assert_allclose(winding_numbers(nested, faces, at_radius(0.05)), 2.0, rtol=0.0, atol=NEAR)
    np.testing.assert_allclose(winding_numbers(nested, faces, at_radius(0.2)), 1.0, rtol=0.0, atol=NEAR)


def test_far_triangles_are_their_solid_angles() -> None:
    random = np.random.default_rng(1)
    soup, faces = random.uniform(size=(60, 3)), np.arange(60).reshape(-1, 3)
    queries = CENTER + 6.0 * directions(50)
    exact = solid_angles(soup, faces, queries)
    error = np.abs(winding_numbers(soup, faces, queries) - exact)
    assert error.max() < 0.02 * np.abs(exact).max()


@pytest.mark.parametrize("shape", ["sphere", "box", "open box"])
def test_clusters_of_many_triangles(shape: str, monkeypatch: pytest.MonkeyPatch) -> None:
    points, faces = icosphere(4) if shape == "sphere" else box_surface((20, 20, 20), (0.6, 0.6, 0.6))
    points = points - points.mean(axis=0) + CENTER
    faces = faces[faces.shape[0] // 6 :] if shape == "open box" else faces
    monkeypatch.setattr(winding_number, "_MOST_DIPOLES", 800)
    assert 200 < len(winding_number._dipoles(points, faces)[0]) < 2_000 < len(faces)
    # Away from the surface by more than the clusters' size, about sqrt(1.2 / 800).
    queries = np.concatenate([at_radius(0.2), at_radius(0.7)])
    queries = queries[np.linalg.norm(queries[:, None] - points, axis=2).min(axis=1) > 0.08]
    assert len(queries) > 100
    exact = solid_angles(points, faces, queries)
    np.testing.assert_allclose(winding_numbers(points, faces, queries), exact, rtol=0.0, atol=NEAR)


def test_clusters_keep_the_two_sides_of_a_sheet_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    points, faces = box_surface((20, 20, 1), (0.6, 0.6, 0.02))
    points = points - points.mean(axis=0) + CENTER
    monkeypatch.setattr(winding_number, "_MOST_DIPOLES", 200)
    _, normals = winding_number._dipoles(points, faces)
    assert np.linalg.norm(normals, axis=1).sum() > 0.7
    np.testing.assert_allclose(normals.sum(axis=0), 0.0, rtol=0.0, atol=1e-12)


def test_no_queries_and_no_faces() -> None:
    assert winding_numbers(BALL, BALL_FACES, np.empty((0, 3))).shape == (0,)
    np.testing.assert_array_equal(winding_numbers(BALL, BALL_FACES[:0], at_radius(0.1)), 0.0)


@pytest.mark.parametrize("most", [8_000, 10])
def test_triangles_without_an_area_do_not_wind(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(winding_number, "_MOST_DIPOLES", most)
    random = np.random.default_rng(2)
    points = random.uniform(size=(30, 3))
    faces = np.repeat(np.arange(30), 3).reshape(-1, 3)
    # At the triangles themselves as well.
    np.testing.assert_array_equal(winding_numbers(points, faces, np.concatenate([points, points + 1e-9])), 0.0)


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6, 1.0])
def test_finite_on_the_surface_itself(size: float) -> None:
    points = CENTER + size * (BALL - CENTER)
    queries = np.concatenate([points, points[BALL_FACES].mean(axis=1), CENTER[None]])
    found = winding_numbers(points, BALL_FACES, queries)
    assert np.isfinite(found).all()
    assert np.abs(found).max() < 3.0


def test_each_query_on_its_own_gives_the_same() -> None:
    queries = np.random.default_rng(3).uniform(size=(150, 3))
    alone = [winding_numbers(BALL, BALL_FACES, query[None])[0] for query in queries[::10]]
    np.testing.assert_allclose(winding_numbers(BALL, BALL_FACES, queries)[::10], alone, rtol=0.0, atol=1e-12)


def test_exact_numbers_close_to_the_surface_and_on_it() -> None:
    points, faces = icosphere(1, 1.0)
    middles, normals = points[faces].mean(axis=1), face_normals(points, faces)
    for side, expected in ((-1e-9, 1.0), (1e-9, 0.0)):
        found = exact_winding_numbers(points, faces, middles + side * normals)
        np.testing.assert_allclose(found, expected, atol=1e-6)
    on_it = exact_winding_numbers(points, faces, middles, np.arange(len(faces)))
    np.testing.assert_allclose(on_it, 0.5, atol=1e-9)
    np.testing.assert_allclose(exact_winding_numbers(points, faces[:, ::-1], points.mean(axis=0)[None]), -1.0)
