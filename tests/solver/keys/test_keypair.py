# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Unusable input is refused with a sentence that says what to do."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.keys.checks import require_sizes
from qc3d_addon.solver.keys.keypair import KeyPair

from ..meshes import icosphere

POINTS, FACES = icosphere(0)


def with_value(array: np.ndarray, place: tuple[int, int], value: float) -> np.ndarray:
    changed = array.copy()
    changed[place] = value
    return changed


class TestKeyPair:
    def test_arrays_are_copied_and_typed(self) -> None:
        key0 = POINTS.astype(np.float32)
        pair = KeyPair.checked(key0, POINTS.tolist(), FACES.astype(np.int32), [[0, 1]])
        assert pair.key0.dtype == pair.key1.dtype == np.float64
        assert pair.faces.dtype == pair.edges.dtype == np.int64
        key0[:] = 0.0
        np.testing.assert_array_equal(pair.key0, POINTS.astype(np.float32))

    def test_diagonal(self) -> None:
        key0 = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 12]])
        assert KeyPair.checked(key0, 2.0 * key0, np.empty((0, 3))).diagonal == 13.0

    @pytest.mark.parametrize("place", [0.0, 30.0, 3000.0])
    @pytest.mark.parametrize("steps", [0, 1, 3])
    def test_seams_are_found_up_to_a_few_steps_of_single_precision(self, steps: int, place: float) -> None:
        # The sphere as single triangles, whose corners were rounded one by one.
        random = np.random.default_rng(1)
        keys = []
        for key in (POINTS + place, 3.0 * POINTS):
            loose = key[FACES.ravel()].astype(np.float32)
            keys.append(loose + random.integers(-steps, steps + 1, loose.shape) * np.spacing(loose))
        pair = KeyPair.checked(*keys, np.arange(FACES.size).reshape(-1, 3))
        vertices, group = pair.welding
        assert len(vertices) == len(POINTS)
        np.testing.assert_array_equal(group[vertices], np.arange(len(vertices)))
        assert (pair.nearly_coincident > 0) == (steps > 0)
        assert len(np.unique(pair.welded_faces)) == len(POINTS)

    def test_neighbors_stay_apart_however_small_the_mesh_is_beside_its_place(self) -> None:
        far = np.array([3e4, -1e4, 2e4]) + POINTS
        pair = KeyPair.checked(far, far + 0.01 * POINTS, FACES)
        assert len(pair.welding[0]) == len(POINTS)
        assert pair.nearly_coincident == 0

    def test_without_edges_and_faces(self) -> None:
        pair = KeyPair.checked(POINTS, POINTS, np.empty((0, 3)))
        assert pair.faces.shape == (0, 3)
        assert pair.edges.shape == (0, 2)

    @pytest.mark.parametrize(
        ("arguments", "sentence"),
        [
            ((POINTS[:, :2], POINTS, FACES), "The first key has shape (12, 2)"),
            ((POINTS, POINTS.ravel(), FACES), "The second key has shape (36,)"),
            ((POINTS, POINTS[1:], FACES), "The keys have 12 and 11 vertices"),
            ((POINTS[:0], POINTS[:0], FACES[:0]), "The mesh has no vertices"),
            ((with_value(POINTS, (7, 1), np.nan), POINTS, FACES), "Vertex 7 of the first key"),
            ((POINTS, with_value(POINTS, (3, 2), -np.inf), FACES), "Vertex 3 of the second key"),
            ((POINTS, POINTS, FACES[:, :2]), "faces has shape (20, 2)"),
            ((POINTS, POINTS, FACES.astype(float)), "faces holds float64 values"),
            ((POINTS, POINTS, FACES + 1), "faces refers to a vertex outside 0..11"),
            ((POINTS, POINTS, FACES - 1), "faces refers to a vertex outside 0..11"),
            ((POINTS, POINTS, FACES, FACES), "edges has shape (20, 3)"),
            ((POINTS, POINTS, FACES, [[0, 12]]), "edges refers to a vertex outside 0..11"),
        ],
    )
    def test_refused_with_a_sentence(self, arguments: tuple[Any, ...], sentence: str) -> None:
        with pytest.raises(InputError, match=re.escape(sentence)):
            KeyPair.checked(*arguments)

    @pytest.mark.parametrize("key0", [POINTS, POINTS * [1, 1, 0], POINTS * [0, 1, 0], np.ones_like(POINTS)])
    @pytest.mark.parametrize("key1", [POINTS, POINTS * [1, 0, 1], np.zeros_like(POINTS)])
    def test_flat_keys_and_keys_in_a_point_are_taken(self, key0: np.ndarray, key1: np.ndarray) -> None:
        pair = KeyPair.checked(key0, key1, FACES)
        require_sizes(pair.key0, pair.key1)
        assert np.isfinite(1.0 / pair.diagonal)

    @pytest.mark.parametrize(
        ("key0", "key1", "sentence"),
        [
            (1e200 * POINTS, POINTS, "The first key has coordinates up to 8e+199"),
            (POINTS, 1e-200 * POINTS, "The second key is only 5e-201 in size"),
            (1e-20 * POINTS, 1e20 * POINTS, "1e+40 times as large"),
            (POINTS, 1e-12 * POINTS, "1e-12 times as large"),
        ],
    )
    def test_sizes_that_only_mode_straight_takes(self, key0: np.ndarray, key1: np.ndarray, sentence: str) -> None:
        with pytest.raises(InputError, match=re.escape(sentence) + ".*choose the mode straight"):
            require_sizes(key0, key1)


@pytest.mark.parametrize("gap", [0.0, 1e-9, 0.5])
def test_a_pair_that_shares_knows_the_same(gap: float) -> None:
    """Also where vertices coincide: in the first key only, in both, or in none."""
    key0 = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    key0[3:5, 2] += gap
    faces = np.array([[0, 1, 2], [3, 5, 4]])
    keys = [key0 + [0.0, 0.0, 1.0], key0 + np.linspace(0.0, 1.0, 6)[:, None]]
    base, *others = (KeyPair.checked(key0, key, faces, [[0, 5]]) for key in (key0, *keys))
    for pair in others:
        shared = pair.sharing(base)
        for name in ("welding", "covering"):
            for found, expected in zip(getattr(shared, name), getattr(pair, name), strict=True):
                np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(shared.every_edge, pair.every_edge)
        np.testing.assert_array_equal(shared.key1, pair.key1)
