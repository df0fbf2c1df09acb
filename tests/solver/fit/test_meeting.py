# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The quality ``exact``: maps without folds that meet both keys."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver import api
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit import local_meeting, meeting
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.fit.meeting import MET
from qc3d_addon.solver.fit.own_crossings import crossing_vertices
from qc3d_addon.solver.fit.storage import from_bytes, to_bytes
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from ..baking import frames_of
from ..meshes import icosphere

EXACT = FitOptions(quality="exact")


def bar() -> tuple[Floats, Ints]:
    """A closed box 1 x 1 x 4 of 4 x 4 x 16 squares, each cut in two."""
    lattice = np.stack(np.meshgrid(*[np.arange(count + 1) for count in (4, 4, 16)], indexing="ij"), axis=-1)
    number = np.arange(lattice[..., 0].size).reshape(lattice.shape[:3])
    faces = []
    for axis in range(3):
        for end in (0, -1):
            grid = np.moveaxis(number, axis, 0)[end]
            a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
            turned = [(a, b, c), (a, c, d)] if (end == 0) == (axis == 1) else [(a, c, b), (a, d, c)]
            faces += [np.stack([corner.ravel() for corner in three], axis=1) for three in turned]
    used, triangles = np.unique(np.concatenate(faces), return_inverse=True)
    return lattice.reshape(-1, 3)[used] / 4.0, triangles.reshape(-1, 3)


def twisted(points: Floats, degrees: float) -> Floats:
    """The bar turned about its axis, in proportion to the height."""
    turn = np.radians(degrees) * points[:, 2] / points[:, 2].max()
    x, y = points[:, 0] - 0.5, points[:, 1] - 0.5
    return np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y, points[:, 2]], axis=1)


@pytest.fixture(scope="module")
def bumpy() -> FittedMap:
    """A ball that gets bumps of a few edges' size; no vertex stays in place."""
    points, faces = icosphere(3, 1.0)
    bumps = 1.02 + 0.15 * np.prod(np.sin(5.0 * (points - points.mean(axis=0))), axis=1)
    middle = points.mean(axis=0)
    return finish(fit_pair(KeyPair.checked(points, middle + bumps[:, None] * (points - middle), faces), EXACT))


def assert_met(fitted: FittedMap) -> None:
    """Every vertex is met, and no map on the way has a fold."""
    assert fitted.missed().max() <= MET
    assert fitted.landmark_residual().rms <= 3e-5
    assert [fitted.folds(values) for values in fitted.maps] == [0] * len(fitted.maps)
    assert not any("misses" in note for note in fitted.notes)


def test_a_bar_that_is_twisted() -> None:
    points, faces = bar()
    fitted = finish(fit_pair(KeyPair.checked(points, twisted(points, 90.0), faces), EXACT))
    assert_met(fitted)
    # The bar's ends turn by 90 degrees against one another: the branch is the one that leads there.
    assert 40.0 < np.degrees(np.linalg.norm(fitted.turns[fitted.volume.insideness > 0.5], axis=1)).max() < 120.0


def test_a_ball_with_bumps(bumpy: FittedMap) -> None:
    assert_met(bumpy)
    coarse = finish(fit_pair(bumpy.pair, FitOptions()))
    assert coarse.missed().max() > 2.0 * MET


def test_its_linear_frames_are_proven(bumpy: FittedMap) -> None:
    report = frames_of(bumpy, [0.25, 0.5, 1.0], "linear").report
    assert report.folds.frames == [0, 0, 0]
    assert max(one.missed for one in report.certificates) <= MET
    assert any(note.startswith("In 3 of 3 frames every vertex is within 0.01%") for note in report.notes)


def test_its_natural_frames_meet_the_keys(bumpy: FittedMap) -> None:
    bake = frames_of(bumpy, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(bake.frames[[0, -1]], [bumpy.pair.key0, bumpy.pair.key1])
    assert bake.report.folds.frames == [0, 0, 0]


def test_it_is_stored(bumpy: FittedMap) -> None:
    restored = from_bytes(to_bytes(bumpy), bumpy.pair)
    assert restored.options == EXACT
    np.testing.assert_allclose(restored.missed(), bumpy.missed(), atol=1e-9)


def test_by_the_api() -> None:
    points, faces = icosphere(1, 1.0)
    fit = api.fit(points, points * np.array([1.0, 1.2, 0.9]), faces, quality="exact")
    assert fit.residual.max <= MET


def test_vertices_that_cannot_be_met_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meeting, "_ITERATIONS", 2)
    monkeypatch.setattr(local_meeting, "_FIRST_PULLS", ((1e9, 2),))
    points, faces = icosphere(1, 1.0)
    middle = points.mean(axis=0)
    pushed = points.copy()
    # One cap goes through the opposite side.
    pushed[points[:, 2] - middle[2] > 0.8, 2] -= 2.3
    fitted = finish(fit_pair(KeyPair.checked(points, pushed, faces), EXACT))
    assert fitted.folds(fitted.mapped) == 0
    assert fitted.missed().max() > MET
    assert crossing_vertices(fitted.embedding).any()
    assert any("where a key crosses itself" in note for note in fitted.notes)


def test_the_engine_is_delaunay() -> None:
    with pytest.raises(InputError, match="choose that, or auto"):
        FitOptions(quality="exact", engine="tetwild")
    assert FitOptions(quality="exact", engine="auto").quality == "exact"
