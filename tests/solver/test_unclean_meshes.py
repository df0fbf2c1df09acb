# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as they come: every kind of unclean mesh bakes in all modes, or is refused with a sentence."""

from __future__ import annotations

import json
import time as clock
import warnings
from collections.abc import Callable
from functools import cache
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision.crossings import crossing_pairs
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions, Mode
from qc3d_addon.solver.support.progress import finish

from .baking import frames_of
from .meshes import arced, box_surface, enclosed_volume, icosphere, twisted

pytestmark = [pytest.mark.usefixtures("coarse_volume"), pytest.mark.slow]

T = TypeVar("T")
Keys = tuple[Floats, Floats, Ints] | tuple[Floats, Floats, Ints, Ints]

NORMAL = FitOptions()
MODES: list[Mode] = ["natural", "linear"]
TIMES = [0.0, 0.2, 0.5, 0.9, 1.0]

# A bar whose lower half stays and whose upper half bends, and the same turned and moved so that nothing stays.
BAR, FACES = box_surface((2, 2, 8), (1.0, 1.0, 5.0))
BENT = arced(BAR, 0.9)
BALL, BALL_FACES = icosphere(1, radius=1.0)
SMALL, SMALL_FACES = icosphere(0, radius=1.0)
NO_FACES = np.empty((0, 3), dtype=np.int64)
TURN = rotation_matrices(np.array([[0.3, 0.9, -0.5]]))[0]
RANDOM = np.random.default_rng(0)


def moved(points: Floats) -> Floats:
    return np.asarray(points @ TURN.T + [3.0, -1.0, 2.0])


def pinched(points: Floats, vertex: int, onto: int) -> Floats:
    """One vertex moved onto another: the triangles between them have no area."""
    result = points.copy()
    result[vertex] = result[onto]
    return result


def with_points(*points: Floats) -> Keys:
    """The bar and points without faces, given in both keys."""
    return np.concatenate([BAR, points[0]]), np.concatenate([BENT, points[-1]]), FACES


def split_along_a_seam(faces: Ints) -> tuple[Ints, Ints]:
    """The vertices of a closed bar cut in two halves that touch, and its triangles."""
    side = np.where(BAR[faces].mean(axis=1)[:, :1] < 0.0, faces, faces + len(BAR))
    used, corners = np.unique(side, return_inverse=True)
    return used % len(BAR), corners.reshape(-1, 3)


def parts(shape: Floats, faces: Ints, count: int) -> Keys:
    """Many copies, each moved and turned a little on its own."""
    random = np.random.default_rng(1)
    places = random.uniform(0.0, 10.0, size=(count, 1, 3))
    turns = rotation_matrices(random.normal(scale=0.5, size=(count, 3)))
    later = shape @ turns.transpose(0, 2, 1) + places + random.normal(scale=0.3, size=(count, 1, 3))
    all_faces = faces + len(shape) * np.arange(count)[:, None, None]
    return (shape + places).reshape(-1, 3), later.reshape(-1, 3), all_faces.reshape(-1, 3)


def n_gon_prism() -> Keys:
    """A prism of two 24-gons, each triangulated as a fan from a corner, with corners on straight edges as well."""
    angles = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    corners = np.column_stack([np.cos(angles), np.sin(angles)])
    ring = np.stack([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))], axis=1).reshape(-1, 2)
    count = len(ring)
    points = np.concatenate([np.column_stack([ring, np.full(count, height)]) for height in (0.0, 2.0, 4.0)])
    fan = np.column_stack([np.zeros(count - 2, dtype=int), np.arange(1, count - 1), np.arange(2, count)])
    around = np.arange(count)
    after = (around + 1) % count
    walls = [
        np.column_stack(triangle)
        for triangle in ((around, after, after + count), (around, after + count, around + count))
    ]
    faces = np.concatenate([fan[:, ::-1], fan + 2 * count, *walls, *(wall + count for wall in walls)])
    return points, twisted(points, 0.8), faces


SEAM, SEAM_FACES = split_along_a_seam(FACES)
ULPS = np.random.default_rng(3).integers(-1, 2, (2, len(SEAM), 3)) * np.spacing(np.float32(5.0)) / 2.0
LOOSE = RANDOM.uniform(-2.0, 6.0, size=(15, 3))
WIRE = np.linspace([0.0, 0.0, 5.0], [1.0, 0.0, 8.0], 6)
WIRES = len(BAR) + np.column_stack([np.arange(5), np.arange(1, 6)])
CLOUD = RANDOM.normal(size=(200, 3))
SIDES = np.unique(np.sort(FACES[:, [0, 1]], axis=1), axis=0)
MIXED = np.where((np.arange(len(FACES)) % 3 == 0)[:, None], FACES[:, ::-1], FACES)
FIN = np.array([[*FACES[10, :2], len(BAR)]])
OPEN = FACES[(BAR[FACES].mean(axis=1)[:, 2] > 1e-9) & (BAR[FACES].mean(axis=1)[:, 0] < 0.49)]
NEARLY_A_LINE = np.outer(np.arange(15), [-1.1797948846826836, 0.4755176467499659, 0.8469639000783107])
FAR = np.array([[256.63, 102.35, 287.03], [809.26, 389.32, -719.44], [694.50, 428.95, -163.56]])
TETRAHEDRON = np.concatenate([np.eye(3), np.zeros((1, 3))])
NESTED = np.concatenate([BALL, 0.6 * BALL, 0.3 * BALL])
BALLS = np.concatenate([BALL_FACES + number * len(BALL) for number in range(3)])

KINDS: dict[str, Keys] = {
    "clean": (BAR, BENT, FACES),
    "n-gons": n_gon_prism(),
    "loose vertices": with_points(LOOSE, LOOSE + RANDOM.normal(scale=0.3, size=LOOSE.shape)),
    "loose vertices that stay": with_points(LOOSE),
    "wires": (*with_points(WIRE, WIRE @ TURN.T), WIRES),
    "wires on faces and onto themselves": (BAR, BENT, FACES, np.concatenate([SIDES, SIDES[:, ::-1], [[0, 0], [3, 3]]])),
    "a seam": (BAR[SEAM], BENT[SEAM], SEAM_FACES),
    "a seam on the move": (BAR[SEAM], moved(BENT)[SEAM], SEAM_FACES),
    "a rounded seam": (BAR[SEAM] + ULPS[0], BENT[SEAM] + ULPS[1], SEAM_FACES),
    "a rounded seam on the move": (BAR[SEAM] + ULPS[0], moved(BENT)[SEAM] + ULPS[1], SEAM_FACES),
    "every triangle on its own": (BAR[FACES.ravel()], BENT[FACES.ravel()], np.arange(FACES.size).reshape(-1, 3)),
    "no area in the first key": (pinched(BAR, *FACES[5, :2]), BENT, FACES),
    "no area in the second key": (BAR, pinched(BENT, *FACES[40, :2]), FACES),
    "no area in either": (pinched(BAR, *FACES[40, :2]), pinched(BENT, *FACES[40, :2]), FACES),
    "faces that are lines and points": (BAR, BENT, np.concatenate([FACES, [[0, 0, 1], [3, 3, 3], [4, 5, 4]]])),
    "only faces that are points": (CLOUD, twisted(CLOUD, 1.0), np.repeat(np.arange(len(CLOUD)), 3).reshape(-1, 3)),
    "repeated faces": (BAR, BENT, np.concatenate([FACES, FACES[:40], FACES[:5], FACES[60:80, ::-1]])),
    "some faces reversed": (BAR, BENT, MIXED),
    "all faces reversed": (BAR, BENT, FACES[:, ::-1]),
    "nested spheres": (
        NESTED,
        np.concatenate([BALL * [1, 1.3, 1], 0.5 * BALL, 0.35 * BALL + 0.1]),
        BALLS,
    ),
    "open": (BAR, BENT, OPEN),
    "a fin": (*with_points(np.array([[0.0, 2.0, 2.0]]), np.array([[0.5, 2.2, 2.0]]))[:2], np.concatenate([FACES, FIN])),
    "a point cloud": (CLOUD, twisted(CLOUD, 1.0), NO_FACES),
    "a point cloud, half still": (CLOUD, np.where(CLOUD[:, 2:] > 0.0, twisted(CLOUD, 1.0), CLOUD), NO_FACES),
    "only wires": (BAR, BENT, NO_FACES, SIDES),
    "a triangle and loose vertices": (
        np.concatenate([np.eye(3), CLOUD[:5]]),
        np.concatenate([np.eye(3) @ TURN, CLOUD[5:10]]),
        np.array([[0, 1, 2]]),
    ),
    "four vertices": (TETRAHEDRON, TETRAHEDRON * [1.0, 1.0, -0.5], np.array([[0, 1, 2]])),
    "a tetrahedron": (TETRAHEDRON, moved(TETRAHEDRON), np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])),
    "a triangle with next to no area far from the rest": (
        np.concatenate([NEARLY_A_LINE, FAR]),
        np.concatenate([NEARLY_A_LINE * [-1, 1, 1] + [-2.478, 0.615, -0.181], FAR]),
        np.array([[0, 1, 14]]),
    ),
    "a part that stays": (
        np.concatenate([BAR, BAR + [3, 0, 0]]),
        np.concatenate([BENT, BAR + [3, 0, 0]]),
        np.concatenate([FACES, FACES + len(BAR)]),
    ),
    "tiny": (1e-6 * BAR, 1e-6 * moved(BENT), FACES),
    "huge": (1e6 * BAR, 1e6 * BENT, FACES),
    "very tiny": (1e-30 * BAR, 1e-30 * BENT, FACES),
    "very huge": (1e30 * BAR, 1e30 * moved(BENT), FACES),
    "as tiny as may be": (1e-74 * BAR, 1e-74 * moved(BENT), FACES),
    "as huge as may be": (1e74 * BAR, 1e74 * moved(BENT), FACES),
    "far away": (BAR + [3e4, 5e4, -1e4], BENT + [3e4, 5e4, -1e4], FACES),
    "far away, nothing still": (BAR + [3e4, 5e4, -1e4], moved(BENT) + [3e4, 5e4, -1e4], FACES),
    "moved far": (BAR, moved(BENT) + [3e4, 5e4, -1e4], FACES),
    "other units": (BAR, 1e-3 * BENT, FACES),
    "identical": (BAR, BAR, FACES),
    "moved as a whole": (BAR, moved(BAR), FACES),
    "squashed nearly into a point": (BAR, BAR[0] + 1e-6 * (BENT - BAR[0]), FACES),
    "squashed nearly flat": (BAR, BAR * [1.0, 1e-4, 1.0], FACES),
    "flat in the first key": (BAR * [1, 0, 1], BENT, FACES),
    "flat in the second key": (BAR, BENT * [1, 1, 0], FACES),
    "a line in the second key": (BAR, BENT * [0, 0, 1], FACES),
    "flat in both": (BAR * [1, 0, 1], moved(BENT * [1, 0, 1]), FACES),
    "one point in the second key": (BAR, np.broadcast_to(BENT[7], BENT.shape), FACES),
    "one point in the first key": (np.broadcast_to(BENT[7], BENT.shape), BAR, FACES),
    "one point in both": (np.zeros_like(BAR), np.ones_like(BAR), FACES),
    "one vertex": (BAR[:1], BAR[1:2], NO_FACES),
    "two vertices": (BAR[:2], BAR[1:3], NO_FACES, np.array([[0, 1]])),
    "one triangle": (BAR[:3], BAR[:3] @ TURN, np.array([[0, 1, 2]])),
    "a half squashed into a point": (BAR, np.where(BAR[:, 2:] > 3.0, [[0.0, 0.0, 3.5]], BAR), FACES),
}
UNREACHABLE: dict[str, Keys] = {
    "mirrored": (BAR + [0.3, 0, 0], (BAR + [0.3, 0, 0]) * [-1, 1, 1], FACES),
    "turned inside out": (SMALL * [0.3, 0.4, 1.0], SMALL * [-0.3, -0.3, -0.9], SMALL_FACES),
}
PARTLY_UNREACHABLE: dict[str, Keys] = {
    "a small part turned inside out": (
        np.concatenate([BAR, 0.2 * SMALL + [2.0, 0.0, 2.0]]),
        np.concatenate([BENT, -0.2 * SMALL + [2.0, 0.0, 2.0]]),
        np.concatenate([FACES, SMALL_FACES + len(BAR)]),
    ),
}
MANY: dict[str, Keys] = {
    "2000 triangles": parts(RANDOM.normal(scale=0.1, size=(3, 3)), np.arange(3)[None], 2_000),
    "2000 cubes": parts(*box_surface((1, 1, 1), (0.15, 0.15, 0.15)), 2_000),
}
EVERY = {**KINDS, **UNREACHABLE, **PARTLY_UNREACHABLE, **MANY}
# Here the coarse surroundings of the test cannot follow; the surface meets its keys all the same, to fewer digits.
FLATTENED = {"squashed nearly flat", "moved far"}


@cache
def pair_of(kind: str) -> KeyPair:
    return KeyPair.checked(*EVERY[kind])


@cache
def prepared_once(kind: str) -> FittedMap:
    return strictly(lambda: finish(fit_pair(pair_of(kind), NORMAL)))


def times_of(kind: str) -> list[float]:
    return TIMES[::2] if kind in MANY else TIMES


@cache
def baked_and_timed(kind: str, mode: Mode) -> tuple[Bake, float]:
    """A bake and the seconds of a processor that it took."""
    started = clock.process_time()
    fitted = prepared_once(kind)
    bake = strictly(lambda: frames_of(fitted, times_of(kind), mode))
    return bake, clock.process_time() - started


def baked_once(kind: str, mode: Mode) -> Bake:
    return baked_and_timed(kind, mode)[0]


def strictly(work: Callable[[], T]) -> T:
    """Run with every warning, and every number that is not one, as an error."""
    with warnings.catch_warnings(), np.errstate(all="raise", under="ignore"):
        warnings.simplefilter("error")
        return work()


def assert_sound(bake: Bake, pair: KeyPair, mode: Mode, key_error: float = 1e-9) -> None:
    """What holds of every bake: finite, keys and still vertices bit for bit, between the keys, no folds, honest."""
    assert np.isfinite(bake.frames).all()
    np.testing.assert_array_equal(bake.frames[0], pair.key0)
    np.testing.assert_array_equal(bake.frames[-1], pair.key1)
    same = (pair.key0 == pair.key1).all(axis=1)
    np.testing.assert_array_equal(bake.frames[:, same], np.broadcast_to(pair.key0[same], bake.frames[:, same].shape))
    size = max(float(np.ptp(key, axis=0).max()) for key in (pair.key0, pair.key1))
    low, high = (reduce(np.stack([pair.key0, pair.key1]), axis=(0, 1)) for reduce in (np.min, np.max))
    around = 1.5 * size + 1e-12 * np.abs(pair.key1).max()
    assert (bake.frames > low - around).all()
    assert (bake.frames < high + around).all()
    report = bake.report
    json.dumps(report.as_json(), allow_nan=False)
    assert report.folds.map == 0
    # Where all is in one point there is no size to measure by; keys are of size 1 then.
    assert report.key_error * pair.diagonal <= key_error * size + 1e-15
    assert all((proof.smallest_determinant <= 0.0) == (proof.folds > 0) for proof in report.certificates)
    if mode == "natural":
        assert report.folds.frames == [0] * len(bake.times)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", KINDS)
def test_bakes(kind: str, mode: Mode) -> None:
    # On a line only lengths are left to hold, and the sweeps do not settle as far.
    error = 1e-5 if kind == "a line in the second key" else 1e-8 if kind in FLATTENED else 1e-9
    assert_sound(baked_once(kind, mode), pair_of(kind), mode, error)


class TestUnreachableKeys:
    @pytest.mark.parametrize("kind", UNREACHABLE)
    def test_refused_before_any_slow_work(self, kind: str) -> None:
        steps = fit_pair(pair_of(kind), NORMAL)
        with pytest.raises(InputError, match=r"mirrored or turned inside out.* Choose the mode straight"):
            strictly(lambda: next(steps))

    @pytest.mark.parametrize("kind", PARTLY_UNREACHABLE)
    @pytest.mark.parametrize("mode", MODES)
    def test_parts_out_of_reach_bake_and_it_is_said(self, kind: str, mode: Mode) -> None:
        bake = baked_once(kind, mode)
        assert_sound(bake, pair_of(kind), mode)
        said = f"inside out between the keys, in the part of 12 vertices to which vertex {len(BAR)} belongs"
        assert any(said in note for note in bake.report.notes)

    def test_nothing_of_the_kind_is_said_of_others(self) -> None:
        for kind in ("clean", "nested spheres", "some faces reversed", "all faces reversed", "moved as a whole"):
            assert baked_once(kind, "natural").report.notes == []


class TestManyParts:
    @pytest.mark.parametrize("mode", MODES)
    @pytest.mark.parametrize("kind", MANY)
    def test_bakes(self, kind: str, mode: Mode) -> None:
        assert_sound(baked_once(kind, mode), pair_of(kind), mode)

    @pytest.mark.parametrize("kind", MANY)
    def test_in_reasonable_time(self, kind: str) -> None:
        assert baked_and_timed(kind, "natural")[1] < 40.0

    def test_each_part_keeps_its_shape(self) -> None:
        frames = baked_once("2000 cubes", "natural").frames.reshape(-1, 2_000, 8, 3)
        lengths = np.linalg.norm(frames[:, :, :, None] - frames[:, :, None], axis=4)
        np.testing.assert_allclose(lengths, np.broadcast_to(lengths[:1], lengths.shape), rtol=0.0, atol=0.005)


class TestSeams:
    @pytest.mark.parametrize("mode", MODES)
    @pytest.mark.parametrize("kind", ["a seam", "a seam on the move", "every triangle on its own"])
    def test_sealed_bit_for_bit(self, kind: str, mode: Mode) -> None:
        pair, frames = pair_of(kind), baked_once(kind, mode).frames
        _, first, group = np.unique(
            np.concatenate([pair.key0, pair.key1], axis=1), axis=0, return_index=True, return_inverse=True
        )
        assert len(first) == len(BAR) < len(pair.key0)
        np.testing.assert_array_equal(frames, frames[:, first[group.ravel()]])

    @pytest.mark.parametrize("kind", ["a seam", "a seam on the move"])
    def test_a_closed_shape_stays_closed(self, kind: str) -> None:
        frames = baked_once(kind, "natural").frames
        volumes = [enclosed_volume(frame, SEAM_FACES) for frame in frames]
        expected = volumes[0] + np.array(TIMES) * (volumes[-1] - volumes[0])
        np.testing.assert_allclose(volumes, expected, rtol=1e-9)


    @pytest.mark.parametrize("mode", MODES)
    @pytest.mark.parametrize("kind", ["a rounded seam", "a rounded seam on the move"])
    def test_sealed_up_to_the_rounding_of_the_keys(self, kind: str, mode: Mode) -> None:
        bake = baked_once(kind, mode)
        copies = [np.flatnonzero(vertex == SEAM) for vertex in np.unique(SEAM)]
        gap = max(np.ptp(bake.frames[:, group], axis=1).max() for group in copies)
        assert 0.0 < gap < 4.0 * np.ptp(ULPS) / 2.0
        assert bake.report.welded == [len(SEAM) - len(BAR)]
        assert any("no more than rounding" in note for note in bake.report.notes)


def test_nested_components_keep_their_volumes_and_their_distance() -> None:
    for time, frame in zip(TIMES, baked_once("nested spheres", "natural").frames, strict=True):
        assert not len(crossing_pairs(frame, BALLS))
        for faces in np.split(BALLS, 3):
            ends = [enclosed_volume(key, faces) for key in KINDS["nested spheres"][:2]]
            expected = (1.0 - time) * ends[0] + time * ends[1]
            assert enclosed_volume(frame, faces) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("mode", MODES)
def test_a_part_that_stays_is_there_bit_for_bit(mode: Mode) -> None:
    frames = baked_once("a part that stays", mode).frames
    for frame in frames:
        np.testing.assert_array_equal(frame[len(BAR) :], BAR + [3, 0, 0])


@pytest.mark.parametrize("mode", MODES)
def test_identical_keys_are_every_frame(mode: Mode) -> None:
    for frame in baked_once("identical", mode).frames:
        np.testing.assert_array_equal(frame, BAR)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("degrees", "pitch"), [(0.0, 4.0), (1e-4, 1.0), (40.0, 0.0), (90.0, 3.0), (179.0, -2.0), (180.0, 1.0)]
)
def test_a_motion_of_everything_is_an_exact_screw(degrees: float, pitch: float, mode: Mode) -> None:
    axis, place = np.array([0.48, -0.6, 0.64]), np.array([2.0, 1.0, -1.0])

    def screw(time: float) -> Floats:
        turn = rotation_matrices(time * np.radians(degrees) * axis[None])[0]
        return np.asarray((BAR - place) @ turn.T + place + time * pitch * axis)

    fitted = screwed_once(degrees, pitch, screw(1.0).tobytes())
    bake = strictly(lambda: frames_of(fitted, TIMES, mode))
    # Half a turn may go either way.
    errors = []
    for way in [1.0, -1.0] if degrees == 180.0 else [1.0]:
        turns = rotation_matrices(way * np.outer(TIMES, np.radians(degrees) * axis))
        expected = (BAR - place) @ turns.transpose(0, 2, 1) + place + np.outer(TIMES, pitch * axis)[:, None]
        errors.append(np.abs(bake.frames - expected).max())
    assert min(errors) < 5e-9


@cache
def screwed_once(degrees: float, pitch: float, key1: bytes) -> FittedMap:
    pair = KeyPair.checked(BAR, np.frombuffer(key1).reshape(-1, 3), FACES)
    return finish(fit_pair(pair, NORMAL))


def test_scaling_by_a_power_of_two_scales_every_bit() -> None:
    factor = 2.0**20
    pair = KeyPair.checked(factor * BAR, factor * BENT, FACES)
    scaled = frames_of(finish(fit_pair(pair, NORMAL)), TIMES)
    np.testing.assert_array_equal(scaled.frames, factor * baked_once("clean", "natural").frames)


def test_wires_keep_their_lengths() -> None:
    # A hair on a head that stays turns as it is, its lengths kept.
    frames = baked_once("wires", "natural").frames[:, len(BAR) :]
    lengths = np.linalg.norm(np.diff(frames, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[:1], lengths.shape), rtol=0.03)


@settings(max_examples=5)
@given(st.integers(0, 2**32 - 1))
def test_soups(seed: int) -> None:
    """Anything that indexes: repeated, degenerate, crossing faces and edges, some vertices doubled, some still."""
    random = np.random.default_rng(seed)
    key0 = random.normal(size=(30, 3))
    key0[20:25] = key0[random.integers(0, 20, size=5)]
    key1 = key0 + random.normal(scale=0.1, size=key0.shape) * (random.uniform(size=(30, 1)) < 0.7)
    key1[20:23] = key1[random.integers(0, 20, size=3)]
    faces, edges = random.integers(0, 30, size=(random.integers(0, 60), 3)), random.integers(0, 30, size=(10, 2))
    pair = KeyPair.checked(key0, key1, faces, edges)
    fitted = strictly(lambda: finish(fit_pair(pair, NORMAL)))
    for mode in MODES:
        assert_sound(strictly(lambda mode=mode: frames_of(fitted, TIMES, mode)), pair, mode)


@pytest.mark.parametrize(
    ("key0", "key1", "sentence"),
    [
        (BAR[:0], BAR[:0], "has no vertices"),
        (BAR, np.full_like(BAR, np.nan), "Vertex 0 of the second key has a coordinate that is not finite"),
        (np.full_like(BAR, -np.inf), BENT, "Vertex 0 of the first key has a coordinate that is not finite"),
        (1e200 * BAR, 1e200 * BENT, "first key has coordinates up to 5e\\+200; scale the mesh"),
        (BAR, 1e307 * BENT, "second key has coordinates up to"),
        (1.7e308 * np.sign(BAR - BAR.mean(axis=0)), BAR, "first key has coordinates up to 2e.308, whose differences"),
        (1e-200 * BAR, 1e-200 * BENT, "first key is only 5e-200 in size; scale the mesh"),
        (1e-20 * BAR, 1e20 * BENT, "1e\\+40 times as large"),
        (BAR, 1e-12 * BENT, "1e-12 times as large"),
    ],
)
def test_what_cannot_be_baked_is_refused_with_a_sentence(key0: Floats, key1: Floats, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        strictly(lambda: next(fit_pair(KeyPair.checked(key0, key1, NO_FACES), NORMAL)))
