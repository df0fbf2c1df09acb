# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of tetrahedra that follow the motion between two keys."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.meshing.cube import fill_cube
from qc3d_addon.solver.meshing.motion_sizes import MotionSizes
from qc3d_addon.solver.meshing.poisson_disk import RESOLUTIONS, sample_cube, sample_surface
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from ..fit.test_meeting import bar
from ..meshes import icosphere

NORMAL = RESOLUTIONS["normal"]


def in_the_cube() -> tuple[Floats, Ints]:
    """A bar along z, as long as half the cube."""
    points, faces = bar()
    return 0.5 + 0.125 * (points - [0.5, 0.5, 2.0]), faces


def bent_at_the_top(points: Floats) -> Floats:
    """The upper quarter leans over, by up to 0.05."""
    return points + np.maximum(points[:, 2:] - 0.625, 0.0) * [0.4, 0.0, 0.0]


def sizes(points: Floats, faces: Ints, moved: Floats | None) -> MotionSizes:
    return MotionSizes.of(points, faces, moved, NORMAL, np.random.default_rng(0))


def test_small_at_the_bend_and_large_where_the_motion_is_affine() -> None:
    points, faces = in_the_cube()
    found = sizes(points, faces, bent_at_the_top(points))
    bend, below = (found(points[np.abs(points[:, 2] - height) < 0.02]) for height in (0.625, 0.3))
    assert np.median(bend) < 0.7 * np.median(below)
    # They grow by at most 0.6 of the distance.
    places = np.random.default_rng(1).uniform(size=(300, 3))
    apart = np.linalg.norm(places[1:] - places[:-1], axis=1)
    assert (np.abs(np.diff(found(places))) <= 0.6 * apart + 1e-12).all()


@pytest.mark.parametrize("moved", [False, True])
def test_there_are_about_as_many_samples_as_the_resolution_gives(moved: bool) -> None:
    points, faces = in_the_cube()
    found = sizes(points, faces, bent_at_the_top(points) if moved else None)
    random = np.random.default_rng(2)
    samples = sample_cube(sample_surface(points, faces, found.finest, random, found), found, random)
    surface = sample_surface(points, faces, NORMAL.spacing, random)
    evenly = sample_cube(surface, NORMAL.around(surface), random)
    assert 0.6 * len(evenly) < len(samples) < 1.3 * len(evenly)


def test_without_a_second_key_or_triangles_they_are_the_same_everywhere() -> None:
    points, faces = in_the_cube()
    for triangles, moved in ((faces, None), (faces[:0], bent_at_the_top(points)), (faces, points + 0.1)):
        found = sizes(points, triangles, moved)
        assert np.ptp(found.local) < 1e-6 * found.finest


def test_one_vertex_is_enough() -> None:
    mesh = fill_cube(np.full((1, 3), 0.5), np.empty((0, 3), dtype=np.int64), FitOptions(), np.full((1, 3), 0.6)).mesh
    assert len(mesh.tets) > 100


def test_a_map_misses_less_than_with_tetrahedra_that_do_not_follow_the_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    points, faces = icosphere(4)
    pushed = points + 0.1 * np.exp(-(((points - [0.5, 0.5, 0.8]) / 0.06) ** 2).sum(axis=1))[:, None] * [1.0, 0.0, 0.0]
    pair = KeyPair.checked(points, pushed, faces)
    followed = finish(fit_pair(pair, FitOptions())).landmark_residual().rms
    every = MotionSizes.of

    def without(points: Floats, faces: Ints, moved: Floats | None, *others: object) -> MotionSizes:
        return every(points, faces, None, *others)  # type: ignore[arg-type]

    monkeypatch.setattr(MotionSizes, "of", without)
    evenly = finish(fit_pair(pair, FitOptions())).landmark_residual().rms
    assert followed < 0.7 * evenly
    assert followed < 2e-4  # it was 1.1e-3 where a fit ended after a shortened step
