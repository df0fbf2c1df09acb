# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's sampling: how many samples are kept where, against the probabilities themselves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.meshing.cube import fill_cube
from qc3d_addon.solver.meshing.poisson_disk import sample_cube, sample_surface
from qc3d_addon.solver.meshing.published_samples import Discarding, sample_cube_as_published
from qc3d_addon.solver.meshing.slivers import WANTED_ANGLE, smallest_dihedral_angles
from qc3d_addon.solver.settings import FitOptions

from ..meshes import icosphere


def test_the_probabilities() -> None:
    discarding = Discarding(radius=0.1, threshold=2.0, sparsity=3.0)
    found = discarding.kept(np.array([0.0, 0.05, 0.2, 0.5]))
    np.testing.assert_allclose(found, [0.0, 0.25, 1.0, np.exp(-0.9)])
    np.testing.assert_allclose(Discarding(0.1, 0.0, 3.0).kept(np.array([0.0, 0.5])), [1.0, np.exp(-1.5)])
    np.testing.assert_array_equal(Discarding(0.1, 0.0, 0.0).kept(np.array([0.0, 0.5])), 1.0)


@pytest.mark.slow
def test_as_many_are_kept_as_the_probabilities_say() -> None:
    points, faces = icosphere(2)
    surface = sample_surface(points, faces, 0.05, np.random.default_rng(0))
    discarding = Discarding(radius=0.05, threshold=1.5, sparsity=8.0)
    kept, tried = np.zeros(3), np.zeros(3)
    shells = np.array([0.05, 0.07, 0.2, 0.6])
    for seed in range(6):
        every = sample_cube(surface, lambda positions: np.full(len(positions), 0.05), np.random.default_rng(seed))
        found = sample_cube_as_published(surface, discarding, np.random.default_rng(seed))
        assert cKDTree(found).query(found, k=2)[0][:, 1].min() >= 0.05 - 1e-12  # one uniform Poisson disk
        for samples, counts in ((every, tried), (found, kept)):
            counts += np.histogram(cKDTree(surface).query(samples[8 + len(surface) :])[0], shells)[0]
        if not seed:
            apart = cKDTree(surface).query(every[8 + len(surface) :])[0]
            expected = [
                discarding.kept(apart[(apart >= low) & (apart < high)]).mean() for low, high in pairwise(shells)
            ]
    np.testing.assert_allclose(kept / tried, expected, atol=0.05)
    np.testing.assert_array_equal(found[8 : 8 + len(surface)], surface)


@pytest.mark.slow
def test_it_fills_the_cube() -> None:
    points, faces = icosphere(1)
    dense, sparse = (
        fill_cube(points, faces, FitOptions(sampling="published", sparsity=sparsity)).mesh for sparsity in (10.0, 30.0)
    )
    assert len(sparse.points) < 0.7 * len(dense.points)
    # Of few samples that are left at random, some lie across gaps that no rearrangement of a few rounds closes.
    assert smallest_dihedral_angles(dense).min() >= WANTED_ANGLE
    assert smallest_dihedral_angles(sparse).min() > WANTED_ANGLE / 4.0
    same = fill_cube(points, faces, FitOptions(sampling="published", sparsity=10.0)).mesh
    np.testing.assert_array_equal(dense.points, same.points)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"sampling": "uniform"}, "Unknown sampling"),
        ({"threshold": -1.0}, "The threshold of the sampling is -1.0; it must be a number from 0 to 10"),
        ({"threshold": float("nan")}, "The threshold of the sampling is nan"),
        ({"sparsity": 1e9}, "The sparsity of the sampling is 1000000000.0; it must be a number from 0 to 100"),
        ({"sampling": "published", "engine": "auto"}, "belongs to the engine delaunay"),
        ({"sampling": "published", "quality": "exact"}, "a quality other than exact"),
        ({"sparsity": "much"}, "The sparsity of the sampling is 'much'"),
    ],
)
def test_options_that_are_none(options: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        FitOptions(**options)


def test_fits_of_different_samplings_do_not_take_each_other_s_place() -> None:
    texts = {
        FitOptions().identity,
        FitOptions(sampling="published").identity,
        FitOptions(sampling="published", sparsity=1.0).identity,
        FitOptions(sampling="published", threshold=2.0).identity,
    }
    assert len(texts) == 4
    assert FitOptions().identity == FitOptions(sparsity=1.0).identity  # which counts for nothing there
