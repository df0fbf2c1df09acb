# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole pipeline from two keys to frames in all modes, and its report."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import cache
from typing import Any

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.frames.bake import Bake, evenly_spaced
from qc3d_addon.solver.frames.report import BakeReport, Folds
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import determinants, rotation_matrices
from qc3d_addon.solver.settings import FitOptions, Mode
from qc3d_addon.solver.support.progress import Progress, finish

from ..baking import frames_of
from ..meshes import arced, bent, box_surface, icosphere, kuhn_grid

NORMAL = FitOptions()
TIMES = [0.0, 0.25, 0.5, 1.0 / 3.0, 1.0]
MODES: list[Mode] = ["natural", "linear"]
BAR, FACES = box_surface((2, 2, 12), (1.0, 1.0, 5.0))
TURN = rotation_matrices(np.array([[0.4, 1.0, -0.3]]))[0]
KEYS = {
    "bending and moving": (BAR, bent(BAR, 1.5) @ TURN.T + [3.0, -2.0, 7.0]),
    "half still, large and far": (1e3 * BAR + 1e5, 1e3 * arced(BAR, 1.0) + 1e5),
}


@cache
def prepared_once(name: str) -> FittedMap:
    return finish(fit_pair(KeyPair.checked(*KEYS[name], FACES), NORMAL))


@cache
def baked_once(name: str, mode: Mode) -> Bake:
    return frames_of(prepared_once(name), TIMES, mode)


@pytest.fixture(params=KEYS)
def fitted(request: pytest.FixtureRequest) -> FittedMap:
    return prepared_once(request.param)


@pytest.fixture(params=[(name, mode) for name in KEYS for mode in MODES], ids=" ".join)
def bake(request: pytest.FixtureRequest) -> tuple[FittedMap, Bake]:
    return prepared_once(request.param[0]), baked_once(*request.param)


class TestPreparedMap:
    def test_from_the_identity_to_the_second_key_without_folds(self, fitted: FittedMap) -> None:
        mesh = fitted.mesh
        np.testing.assert_array_equal(fitted.maps[0], mesh.points)
        np.testing.assert_array_equal(fitted.mapped, fitted.maps[-1])
        for values in fitted.maps:
            assert determinants(mesh.jacobians(values)).min() > 0.0
            assert fitted.folds(values) == 0
            np.testing.assert_array_equal(values[mesh.on_cube_face], mesh.points[mesh.on_cube_face])

    def test_folds_are_counted(self) -> None:
        points, faces = icosphere(0)
        mesh = kuhn_grid(2)
        pair = KeyPair.checked(points, points, faces)
        maps = np.stack([mesh.points, mesh.points])
        fitted = FittedMap.restored(pair, mesh, maps, np.zeros((len(mesh.tets), 3)), NORMAL, "delaunay")
        values = mesh.points.copy()
        values[13] += [0.9, 0.0, 0.0]
        assert fitted.folds(values) == np.count_nonzero(np.linalg.det(mesh.jacobians(values)) <= 0.0) > 0
        assert fitted.folds(np.zeros_like(values)) == len(mesh.tets)

    def test_the_first_key_lies_in_the_mesh(self, fitted: FittedMap) -> None:
        landmarks = fitted.landmarks @ fitted.mesh.points
        np.testing.assert_allclose(landmarks, fitted.embedding.key0, rtol=0.0, atol=1e-13)

    def test_residual(self, fitted: FittedMap) -> None:
        embedding = fitted.embedding
        missed = np.linalg.norm(fitted.landmarks @ fitted.mapped - embedding.key1, axis=1)
        missed /= embedding.scale * fitted.pair.diagonal
        residual = fitted.landmark_residual()
        assert residual.max == pytest.approx(missed.max(), rel=1e-9)
        assert residual.rms == pytest.approx(np.sqrt((embedding.weights * missed**2).sum()), rel=1e-9)
        assert residual.rms < 0.01

    def test_seconds_of_every_stage(self, fitted: FittedMap) -> None:
        assert set(fitted.seconds) == {"mesh", "locate", "path", "fit"}
        assert min(fitted.seconds.values()) >= 0.0


class TestFrames:
    def test_the_keys_bit_for_bit(self, bake: tuple[FittedMap, Bake]) -> None:
        fitted, made = bake
        np.testing.assert_array_equal(made.times, TIMES)
        np.testing.assert_array_equal(made.frames[0], fitted.pair.key0)
        np.testing.assert_array_equal(made.frames[-1], fitted.pair.key1)

    def test_the_keys_were_met_before_they_were_put_in(self, bake: tuple[FittedMap, Bake]) -> None:
        assert 0.0 <= bake[1].report.key_error < 1e-9

    def test_frames_are_finite_and_between(self, bake: tuple[FittedMap, Bake]) -> None:
        fitted, made = bake
        assert made.frames.shape == (len(TIMES), *fitted.pair.key0.shape)
        assert np.isfinite(made.frames).all()
        way = np.abs(fitted.pair.key1 - fitted.pair.key0).max()
        assert np.abs(made.frames - fitted.pair.key0).max() < 2.0 * way

    def test_still_vertices_bit_for_bit(self, bake: tuple[FittedMap, Bake]) -> None:
        fitted, made = bake
        still = (fitted.pair.key0 == fitted.pair.key1).all(axis=1)
        assert (fitted.embedding.still >= still).all()
        for frame in made.frames:
            np.testing.assert_array_equal(frame[still], fitted.pair.key0[still])

    def test_a_frame_does_not_depend_on_the_others(self, bake: tuple[FittedMap, Bake]) -> None:
        fitted, made = bake
        alone = frames_of(fitted, 0.5, made.report.mode)
        assert alone.frames.shape[0] == 1
        # To rounding: it is solved together with others.
        np.testing.assert_allclose(alone.frames[0], made.frames[2], rtol=0.0, atol=1e-12)

    def test_natural_frames_have_no_folds(self, bake: tuple[FittedMap, Bake]) -> None:
        _, made = bake
        if made.report.mode == "natural":
            assert made.report.folds.frames == [0] * len(TIMES)
        assert made.report.folds.map == 0

    def test_natural_frames_keep_lengths_better_than_the_straight_blend(self, fitted: FittedMap) -> None:
        pair = fitted.pair
        halfway = frames_of(fitted, 0.5).frames[0]
        edges = np.concatenate([FACES[:, [0, 1]], FACES[:, [1, 2]]])

        def lengths(points: np.ndarray) -> np.ndarray:
            return np.asarray(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1))

        wanted = 0.5 * (lengths(pair.key0) + lengths(pair.key1))
        blend = np.abs(lengths(0.5 * (pair.key0 + pair.key1)) / wanted - 1.0)
        ours = np.abs(lengths(halfway) / wanted - 1.0)
        assert ours.max() < 0.25 * blend.max()


class TestReport:
    def test_every_field(self, bake: tuple[FittedMap, Bake]) -> None:
        fitted, made = bake
        report: dict[str, Any] = json.loads(json.dumps(made.report.as_json()))
        assert report["engine"] == "delaunay"
        assert report["mode"] in MODES
        assert report["vertices"] == len(BAR)
        assert report["tetrahedra"] == len(fitted.mesh.tets)
        assert report["folds"]["map"] == 0
        assert len(report["folds"]["frames"]) == len(TIMES)
        assert report["residual"] == asdict(fitted.landmark_residual())
        assert BakeReport.from_json(report) == made.report
        assert set(report["seconds"]) == {"mesh", "locate", "path", "fit", "factor", "frames", "measure"}
        assert report["peak_memory_mb"] is None or 10.0 < report["peak_memory_mb"] < 1e6
        assert report["notes"] == []

    def test_certificates(self, bake: tuple[FittedMap, Bake]) -> None:
        _, made = bake
        certificates = made.report.certificates
        assert [one.time for one in certificates] == TIMES
        assert [one.folds for one in certificates] == made.report.folds.frames
        for one in certificates:
            assert (one.smallest_determinant > 0.0) == (one.folds == 0)
            assert len(one.place) == 3


class TestTimes:
    def test_evenly_spaced(self) -> None:
        np.testing.assert_allclose(evenly_spaced(3), [0.0, 0.25, 0.5, 0.75, 1.0], rtol=0.0, atol=1e-15)
        assert evenly_spaced(0).tolist() == [0.0, 1.0]
        with pytest.raises(InputError, match="-1; it must be 0 or more"):
            evenly_spaced(-1)

    @pytest.mark.parametrize("times", [[-0.1], [0.5, 1.0001], [np.nan], [np.inf], [[0.0, 1.0]], [None]])
    def test_refused(self, fitted: FittedMap, times: list[Any]) -> None:
        with pytest.raises(InputError, match="times of the frames"):
            frames_of(fitted, times)

    @pytest.mark.parametrize("mode", MODES)
    def test_none_at_all(self, fitted: FittedMap, mode: Mode) -> None:
        made = frames_of(fitted, [], mode)
        assert made.frames.shape == (0, *fitted.pair.key0.shape)
        assert made.report.folds.frames == []

    def test_in_any_order_and_again(self, fitted: FittedMap) -> None:
        made = frames_of(fitted, [1.0, 0.0, 1.0], "linear")
        np.testing.assert_array_equal(made.frames, [fitted.pair.key1, fitted.pair.key0, fitted.pair.key1])


class TestProgress:
    def test_stages_in_order_and_growing(self) -> None:
        seen: list[Progress] = []
        pair = KeyPair.checked(BAR, arced(BAR, 0.3), FACES)
        fitted = finish(fit_pair(pair, NORMAL), seen.append)
        frames_of(fitted, evenly_spaced(2), seen=seen)
        stages = [progress.stage for progress in seen]
        assert list(dict.fromkeys(stages)) == ["mesh", "locate", "fit", "factor", "frames"]
        assert stages == sorted(stages, key=["mesh", "locate", "fit", "factor", "frames"].index)
        for stage in set(stages):
            fractions = [progress.fraction for progress in seen if progress.stage == stage]
            assert fractions == sorted(fractions)
            assert fractions[0] >= 0.0
            assert fractions[-1] == 1.0

    def test_dropped_anywhere(self) -> None:
        steps = fit_pair(KeyPair.checked(BAR, arced(BAR, 0.3), FACES), NORMAL)
        for _ in range(5):
            next(steps)
        steps.close()
        with pytest.raises(StopIteration):
            next(steps)


class TestEngines:
    def test_the_delaunay_engine_repeats_itself(self, fitted: FittedMap) -> None:
        again = finish(fit_pair(fitted.pair, NORMAL))
        np.testing.assert_array_equal(again.mesh.points, fitted.mesh.points)
        np.testing.assert_array_equal(again.mesh.tets, fitted.mesh.tets)
        np.testing.assert_array_equal(again.maps, fitted.maps)

    def test_equal_keys_give_equal_frames(self) -> None:
        fitted = finish(fit_pair(KeyPair.checked(BAR, BAR, FACES), NORMAL))
        for mode in MODES:
            made = frames_of(fitted, [0.0, 0.4, 1.0], mode)
            np.testing.assert_array_equal(made.frames, np.broadcast_to(BAR, made.frames.shape))

    @pytest.mark.parametrize("mode", MODES)
    @pytest.mark.filterwarnings("error")
    def test_points_without_faces(self, mode: Mode) -> None:
        points = icosphere(0)[0]
        fitted = finish(fit_pair(KeyPair.checked(points, 1.5 * points, np.empty((0, 3))), NORMAL))
        made = frames_of(fitted, [0.0, 0.5, 1.0], mode)
        assert made.report.key_error < 1e-9
        assert np.isfinite(made.frames).all()


def test_times_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="numbers"):
        frames_of(prepared_once("bending and moving"), ["soon"])


def test_a_mirrored_key_is_refused_before_the_cube_is_filled() -> None:
    pair = KeyPair.checked(BAR, BAR * [-1.0, 1.0, 1.0], FACES)
    with pytest.raises(InputError, match=r"mirrored or turned inside out.*Choose the mode straight"):
        next(fit_pair(pair, NORMAL))


def test_a_mirrored_part_is_met_and_a_note_says_what_that_is_worth() -> None:
    part = 0.3 * BAR + [3.0, 0.0, 0.0]
    key0, key1 = np.concatenate([BAR, part]), np.concatenate([BAR, part * [-1.0, 1.0, 1.0] + [6.0, 0.0, 0.0]])
    pair = KeyPair.checked(key0, key1, np.concatenate([FACES, FACES + len(BAR)]))
    fitted = finish(fit_pair(pair, NORMAL))
    bake = frames_of(fitted, [0.0, 0.5, 1.0])
    assert any("mirrored" in note for note in bake.report.notes)
    assert bake.report.folds == Folds(0, [0, 0, 0])
    np.testing.assert_array_equal(bake.frames[2], pair.key1)
    assert np.isfinite(bake.frames).all()
