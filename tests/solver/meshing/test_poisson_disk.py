# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Poisson-disk samples: distances kept, no gaps left, grading followed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from qc3d_addon.solver.meshing.poisson_disk import RESOLUTIONS, Resolution, sample_cube, sample_surface, thin

from ..meshes import icosphere

NO_FACES = np.empty((0, 3), dtype=np.int64)


def smallest_distance(points: np.ndarray) -> float:
    return float(cKDTree(points).query(points, k=2)[0][:, 1].min())


@pytest.mark.parametrize("width", [1.0, 0.02], ids=["spread out", "crowded: hundreds in one disk"])
def test_thin_keeps_a_maximal_set_of_disjoint_disks(width: float) -> None:
    candidates = np.random.default_rng(3).uniform(size=(3000, 3)) * width
    radius = 0.1 if width == 1.0 else 0.006
    chosen = thin(candidates, np.full(len(candidates), radius))
    assert smallest_distance(candidates[chosen]) >= radius
    assert cKDTree(candidates[chosen]).query(candidates)[0].max() < radius  # nothing more would fit
    assert chosen[0]  # the earliest candidate has precedence over all


def test_thin_respects_points_chosen_before() -> None:
    candidates = np.random.default_rng(4).uniform(size=(500, 3))
    kept = np.full((1, 3), 0.5)
    chosen = thin(candidates, np.full(len(candidates), 0.2), kept)
    assert chosen.any()
    assert cKDTree(kept).query(candidates[chosen])[0].min() >= 0.2


def test_thin_of_coincident_points_keeps_one() -> None:
    assert thin(np.zeros((200, 3)), np.full(200, 0.1)).sum() == 1


def test_surface_samples_cover_the_surface_evenly() -> None:
    points, faces = icosphere(3)
    samples = sample_surface(points, faces, 0.05, np.random.default_rng(0))
    assert smallest_distance(samples) >= 0.05
    assert cKDTree(samples).query(points)[0].max() < 0.05
    assert np.abs(np.linalg.norm(samples - 0.5, axis=1) - 0.3).max() < 0.005  # on the triangles, just inside the sphere


def test_the_number_of_surface_samples_does_not_follow_the_vertices() -> None:
    counts = [len(sample_surface(*icosphere(level), 0.05, np.random.default_rng(0))) for level in (3, 5)]
    assert counts[0] == pytest.approx(counts[1], rel=0.2)


def test_surface_samples_without_area_are_vertices() -> None:
    points = np.random.default_rng(1).uniform(0.2, 0.8, (40, 3))
    for faces in (NO_FACES, np.array([[0, 0, 1], [2, 2, 2]])):
        samples = sample_surface(points, faces, 1e-6, np.random.default_rng(0))
        assert np.array_equal(np.unique(samples, axis=0), np.unique(points, axis=0))


def test_surface_samples_include_loose_vertices() -> None:
    points, faces = icosphere(1)
    loose = np.array([[0.5, 0.5, 0.5]])
    samples = sample_surface(np.concatenate([points, loose]), faces, 0.05, np.random.default_rng(0))
    assert (samples == loose).all(axis=1).any()


def test_cube_samples_are_graded_and_exact_on_the_faces() -> None:
    surface = np.full((1, 3), 0.5)
    resolution = Resolution(spacing=0.03, slope=0.3, largest=0.12)
    size = resolution.around(surface)
    samples = sample_cube(surface, size, np.random.default_rng(5))
    held = ((samples == 0.0) | (samples == 1.0)).sum(axis=1)
    assert (held == 3).sum() == 8
    assert all((held == count).any() for count in (0, 1, 2))
    assert samples.min() == 0.0
    assert samples.max() == 1.0
    assert (samples == surface).all(axis=1).any()
    # Every disk is respected by one of the two; and the holes are not much larger than the disks.
    nearest, other = (column[:, 1] for column in cKDTree(samples).query(samples, k=2))
    assert (nearest >= np.minimum(size(samples), size(samples[other])) * (1.0 - 1e-12)).all()
    probes = np.random.default_rng(6).uniform(size=(5000, 3))
    assert (cKDTree(samples).query(probes)[0] < 2.0 * size(probes)).all()


def test_the_size_grows_with_the_distance_up_to_its_limit() -> None:
    size = Resolution(spacing=0.02, slope=0.25, largest=0.1).around(np.full((1, 3), 0.5))
    positions = np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 0.7], [0.5, 0.5, 1.0]])
    np.testing.assert_allclose(size(positions), [0.02, 0.07, 0.1], rtol=1e-14)


def test_qualities_are_ordered() -> None:
    spacings = [RESOLUTIONS[quality].spacing for quality in ("normal", "fine", "finest")]
    assert spacings == sorted(spacings, reverse=True)
