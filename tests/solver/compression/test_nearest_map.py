# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The search for the nearest map: its gradient against finite differences, and how it ends where there is no map."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import eye_array

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.compression import nearest_map
from qc3d_addon.solver.compression.modes import Transfer, spectrum
from qc3d_addon.solver.compression.nearest_map import NearestMap, _Search
from qc3d_addon.solver.errors import ReconstructionError
from qc3d_addon.solver.maps.boundary_conditions import Conditions

from ..meshes import jittered_grid, sine_map

MESH = jittered_grid(3, seed=4)
MODES = 5


def problem() -> tuple[NearestMap, Floats, Floats]:
    """The problem, the modes on the tetrahedra, and a target."""
    found = NearestMap(MESH, Conditions.sliding_cube(MESH), eye_array(len(MESH.points)).tocsr())
    target = sine_map(MESH.points, np.full((1, 3), 0.05), np.ones((1, 3, 3)))
    return found, np.asarray(Transfer(MESH).to_tets @ spectrum(MESH, MODES).modes), target


def test_the_gradient_is_that_of_finite_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nearest_map, "_TOLERANCE", 1e-12)
    found, at_tets, target = problem()
    scales = np.linspace(0.5, 2.0, MODES)
    search = _Search(found, at_tets, scales, target)
    random = np.random.default_rng(3)
    numbers = 0.05 * random.normal(size=6 * MODES)
    _, gradient = search.value_and_gradient(numbers)
    step = 1e-5
    for _ in range(8):
        direction = random.normal(size=len(numbers))
        ahead, behind = (search.value_and_gradient(numbers + sign * step * direction)[0] for sign in (1.0, -1.0))
        assert gradient @ direction == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-5, abs=1e-9)


def test_a_start_that_cannot_be_solved_for_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nearest_map, "_MOST_ITERATIONS", 1)
    found, at_tets, target = problem()
    with pytest.raises(ReconstructionError, match="too distorted"):
        found.coefficients(at_tets, np.full((MODES, 6), 0.3), np.ones(MODES), target, 5)


def test_the_search_ends_at_the_nearest_map_where_a_later_one_cannot_be_solved_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, at_tets, target = problem()
    start, scales = np.zeros((MODES, 6)), np.ones(MODES)
    solved = []
    cg = nearest_map.cg

    def failing(*arguments: object, **options: object) -> tuple[Floats, int]:
        solved.append(cg(*arguments, **options))
        return solved[-1][0], int(len(solved) > 18)  # three evaluations of six systems each

    monkeypatch.setattr(nearest_map, "cg", failing)
    best = found.coefficients(at_tets, start, scales, target, 50)
    monkeypatch.setattr(nearest_map, "cg", cg)
    search = _Search(found, at_tets, scales, target)
    distances = [search.value_and_gradient(numbers.ravel())[0] for numbers in (start, best)]
    assert distances[1] < distances[0]
