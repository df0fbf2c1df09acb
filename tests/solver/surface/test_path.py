# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface path: keys, still vertices and volumes exact, rigid parts rigid, turns the right way round."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.surface import sweeps
from qc3d_addon.solver.surface.path import SurfacePath

from ..meshes import arced, bent, box_surface, enclosed_volume, icosphere, twisted

BAR, FACES = box_surface((2, 2, 12), (1.0, 1.0, 5.0))
BALL, BALL_FACES = icosphere(1)
NOTHING = np.empty((0, 3), dtype=np.int64)
TIMES = (0.1, 0.3, 0.5, 0.85)


def turned(points: Floats, turn: list[float], center: Floats | None = None) -> Floats:
    """Points turned about their mean, or about ``center``."""
    middle = points.mean(axis=0) if center is None else center
    return np.asarray((points - middle) @ rotation_matrices(np.array([turn]))[0].T + middle)


def joined(*parts: tuple[Floats, Floats, Ints]) -> tuple[Floats, Floats, Ints]:
    """Several objects as one mesh."""
    starts = np.cumsum([0, *(len(key0) for key0, _, _ in parts)])
    key0, key1 = (np.concatenate([part[which] for part in parts]) for which in (0, 1))
    return key0, key1, np.concatenate([faces + start for (_, _, faces), start in zip(parts, starts, strict=False)])


AWAY = np.array([4.0, 0.0, 0.0])
PAIRS = {
    "twist": (BAR, twisted(BAR, np.radians(270.0)), FACES),
    "bend": (BAR, bent(BAR, np.radians(150.0)), FACES),
    "half still": (BAR, arced(BAR, 1.0), FACES),
    "growing": (BALL, 1.7 * BALL + 3.0, BALL_FACES),
    "two parts": joined((BAR, bent(BAR, 1.0), FACES), (BALL + AWAY, turned(1.2 * BALL + AWAY, [1, 2, 0]), BALL_FACES)),
    "open": (BAR, bent(BAR, 1.0), FACES[:-20]),
    "single triangles": (BAR[FACES.ravel()], bent(BAR, 1.0)[FACES.ravel()], np.arange(FACES.size).reshape(-1, 3)),
    "loose vertices": (np.concatenate([BAR, BALL]), np.concatenate([bent(BAR, 1.0), 1.2 * BALL]), FACES),
    "flat triangles": (BAR, bent(BAR, 1.0), np.concatenate([FACES, [[0, 0, 1], [2, 2, 2]]])),
    "no faces": (BALL, 1.7 * BALL + 3.0, NOTHING),
    "equal": (BALL, BALL, BALL_FACES),
}


def path_of(key0: Floats, key1: Floats, faces: Ints, edges: Ints | None = None) -> tuple[Embedding, SurfacePath]:
    embedding = Embedding.of(KeyPair.checked(key0, key1, faces, edges))
    return embedding, SurfacePath(embedding)


def test_nothing_jumps_in_time() -> None:
    # A thin limb settles slowly: what an acceleration that adapts to each shape makes of it jumps by most of a step.
    limb, faces = box_surface((4, 4, 40), (0.2, 1.0, 10.0))
    path = path_of(limb, arced(limb, 2.4), faces)[1]
    shapes = np.stack([path.positions(time) for time in np.linspace(0.0, 1.0, 33)])
    speed = np.linalg.norm(np.diff(shapes, axis=0), axis=2).max()
    bends = np.linalg.norm(np.diff(shapes, 2, axis=0), axis=2).max(axis=1)
    assert np.abs(np.diff(bends)).max() < 0.02 * speed


@pytest.fixture(scope="module", params=PAIRS)
def pair(request: pytest.FixtureRequest) -> tuple[Embedding, SurfacePath]:
    return path_of(*PAIRS[request.param])


class TestEveryPair:
    def test_both_keys_are_met(self, pair: tuple[Embedding, SurfacePath]) -> None:
        embedding, path = pair
        np.testing.assert_allclose(path.positions(0.0), embedding.key0, rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(path.positions(1.0), embedding.key1, rtol=0.0, atol=1e-10)

    @pytest.mark.parametrize("time", TIMES)
    def test_still_vertices_stay_exactly(self, pair: tuple[Embedding, SurfacePath], time: float) -> None:
        embedding, path = pair
        still = embedding.still
        np.testing.assert_array_equal(path.positions(time)[still], embedding.straight(time)[still])

    def test_the_way_is_continuous(self, pair: tuple[Embedding, SurfacePath]) -> None:
        _, path = pair
        times = np.linspace(0.0, 1.0, 9)
        shapes = np.array([path.positions(time) for time in times])
        assert np.isfinite(shapes).all()
        steps = np.abs(np.diff(shapes, axis=0)).max(axis=(1, 2))
        # No step is much longer than the others: nothing jumps.
        assert steps.max() <= 2.0 * np.median(steps) + 1e-12

    @pytest.mark.parametrize("at_once", [1, 10**6])
    def test_shapes_solved_together_are_those_of_each(
        self, pair: tuple[Embedding, SurfacePath], at_once: int, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(sweeps, "TRIANGLES_IN_CACHE", at_once)
        times = (0.0, 0.2, 0.7, 1.0, 0.7)
        together = pair[1].shapes([(time, None) for time in times])
        for time, shape in zip(times, together, strict=True):
            np.testing.assert_allclose(shape, pair[1].positions(time), rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(together[2], together[4], rtol=0.0, atol=1e-13)

    def test_the_same_time_gives_the_same_shape(self, pair: tuple[Embedding, SurfacePath]) -> None:
        _, path = pair
        first = path.positions(0.37)
        path.positions(0.9)
        np.testing.assert_array_equal(path.positions(0.37), first)


class TestVolumes:
    @pytest.mark.parametrize("name", ["twist", "bend", "half still", "single triangles"])
    @pytest.mark.parametrize("time", TIMES)
    def test_linear_between_the_keys(self, name: str, time: float) -> None:
        embedding, path = path_of(*PAIRS[name])
        faces = embedding.pair.faces
        first, last = (enclosed_volume(key, faces) for key in (embedding.key0, embedding.key1))
        expected = (1.0 - time) * first + time * last
        assert enclosed_volume(path.positions(time), faces) == pytest.approx(expected, rel=1e-6)

    @pytest.mark.parametrize("time", [0.1, 0.3, 0.5])
    def test_linear_however_much_it_grows(self, time: float) -> None:
        self.test_linear_between_the_keys("growing", time)

    @pytest.mark.parametrize("time", TIMES)
    def test_each_component_keeps_its_own(self, time: float) -> None:
        embedding, path = path_of(*PAIRS["two parts"])
        shape = path.positions(time)
        for part in (embedding.pair.faces[: len(FACES)], embedding.pair.faces[len(FACES) :]):
            first, last = (enclosed_volume(key, part) for key in (embedding.key0, embedding.key1))
            assert enclosed_volume(shape, part) == pytest.approx((1.0 - time) * first + time * last, rel=1e-6)

    def test_a_component_turned_inside_out_counts_negative(self) -> None:
        embedding, path = path_of(BAR, bent(BAR, 1.0), FACES[:, ::-1])
        first, last = (enclosed_volume(key, embedding.pair.faces) for key in (embedding.key0, embedding.key1))
        assert last < 0.0
        halfway = enclosed_volume(path.positions(0.5), embedding.pair.faces)
        assert halfway == pytest.approx(0.5 * (first + last), rel=1e-6)


class TestRigidParts:
    @settings(max_examples=15)
    @given(st.integers(0, 2**32 - 1), st.floats(0.0, 3.1), st.sampled_from(TIMES))
    def test_a_rigid_part_beside_a_bending_one_keeps_its_lengths(self, seed: int, angle: float, time: float) -> None:
        random = np.random.default_rng(seed)
        axis = random.normal(size=3)
        turn = angle * axis / np.linalg.norm(axis)
        ball = turned(BALL, turn.tolist()) + AWAY + 0.3 * random.normal(size=3)
        embedding, path = path_of(*joined((BAR, bent(BAR, 1.0), FACES), (BALL + AWAY, ball, BALL_FACES)))
        shape = path.positions(time)[len(BAR) :]
        rest = embedding.key0[len(BAR) :]
        lengths, kept = (np.linalg.norm(one[:, None] - one[None], axis=2) for one in (rest, shape))
        # Near half a turn the part may go the other way, as its neighbor does; its anchors then pull at it a little.
        np.testing.assert_allclose(kept, lengths, rtol=0.0, atol=1e-9 if angle < 2.5 else 2e-5)

    def test_a_rigid_motion_of_everything_is_a_screw(self) -> None:
        # The embedding takes it out, so that nothing is left to do in the cube.
        embedding, path = path_of(BAR, turned(BAR, [0.0, 2.0, 0.5], center=np.array([9.0, 9.0, 9.0])), FACES)
        np.testing.assert_allclose(path.positions(0.4), embedding.key0, rtol=0.0, atol=1e-11)

    def test_a_straight_wire_does_not_leave_its_shape(self) -> None:
        wire = np.linspace([3.0, 0.0, 0.0], [3.0, 0.0, 2.0], 6)
        links = len(BAR) + np.stack([np.arange(5), np.arange(1, 6)], axis=1)
        both = (np.concatenate([BAR, wire]), np.concatenate([bent(BAR, 1.0), wire + [0.5, 0.4, 0.1]]))
        embedding, path = path_of(*both, FACES, links)
        shape = path.positions(0.5)[len(BAR) :]
        expected = 0.5 * (embedding.key0 + embedding.key1)[len(BAR) :]
        spans, wanted = np.diff(shape, axis=0), np.diff(embedding.key0[len(BAR) :], axis=0)
        np.testing.assert_allclose(np.linalg.norm(spans, axis=1), np.linalg.norm(wanted, axis=1), rtol=1e-9)
        # The rigid motion that was taken out of the whole leaves the wire a small turn of its own.
        np.testing.assert_allclose(shape, expected, rtol=0.0, atol=0.02)


class TestTheTrueWayRound:
    @pytest.mark.parametrize("degrees", [60.0, 180.0, 270.0])
    @pytest.mark.parametrize("time", [0.25, 0.5, 0.75])
    def test_a_twisted_bar_is_twisted_between(self, degrees: float, time: float) -> None:
        bar, faces = box_surface((4, 4, 24), (1.0, 1.0, 5.0))
        angle = np.radians(degrees)
        embedding, path = path_of(bar, twisted(bar, angle), faces)
        assert np.count_nonzero(embedding.still) >= 25
        shape = embedding.from_cube(path.positions(time), time)
        # Linearly interpolated stretches are not those of the exact twist; the short way round would miss by 1.
        assert np.abs(shape - twisted(bar, time * angle)).max() < (0.02 if degrees < 90.0 else 0.2)

    @pytest.mark.parametrize("degrees", [60.0, 180.0, 300.0])
    @pytest.mark.parametrize("time", [0.25, 0.5, 0.75])
    def test_a_bent_bar_is_bent_between(self, degrees: float, time: float) -> None:
        bar, faces = box_surface((3, 3, 30), (1.0, 1.0, 5.0))
        angle = np.radians(degrees)
        embedding, path = path_of(bar, bent(bar, angle), faces)
        shape = embedding.from_cube(path.positions(time), time)
        exact = bent(bar, time * angle)
        # Where it is may differ by the rigid motion; its lengths may not.
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
        found, expected = (np.linalg.norm(one[edges[:, 0]] - one[edges[:, 1]], axis=1) for one in (shape, exact))
        np.testing.assert_allclose(found, expected, rtol=0.03)

    def test_two_limbs_turn_opposite_ways(self) -> None:
        # The ends are twisted by 220 degrees either way: both are nearer to where they are the wrong way round.
        bar, faces = box_surface((3, 3, 31), (1.0, 1.0, 5.0))
        middle = bar - [0.0, 0.0, 2.5]
        turns = np.zeros_like(bar)
        turns[:, 2] = np.radians(440.0) * middle[:, 2] / 5.0
        key1 = np.einsum("nij,nj->ni", rotation_matrices(turns), bar)
        embedding, path = path_of(bar, key1, faces)
        shape = embedding.from_cube(path.positions(0.5), 0.5)
        halfway = np.einsum("nij,nj->ni", rotation_matrices(0.5 * turns), bar)
        ends = np.isin(bar[:, 2], [0.0, 5.0])
        assert np.abs(shape - halfway)[ends].max() < 0.3


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.3, -0.5, 1.1]])
def test_vertices_in_a_line_do_not_keep_the_path_from_its_keys(turn: list[float]) -> None:
    # Triangles of three vertices in a line, which single precision gives an area of rounding and any direction.
    ends = {tuple(sorted(edge)) for a, b, c in FACES.tolist() for edge in ((a, b), (b, c), (c, a))}
    edges = np.array(sorted(ends))
    points = turned(np.concatenate([BAR, BAR[edges].mean(axis=1)]), turn).astype(np.float32).astype(np.float64)
    slivers = np.column_stack([edges[:, 0], len(BAR) + np.arange(len(edges)), edges[:, 1]])
    key1 = points + np.maximum(points[:, 2:], 0.0) ** 2 * [0.4, 0.1, -0.1]
    embedding, path = path_of(points, key1.astype(np.float32).astype(np.float64), np.concatenate([FACES, slivers]))
    for time, key in ((1e-6, embedding.key0), (1.0 - 1e-6, embedding.key1)):
        assert np.abs(path.positions(time) - key).max() < 1e-5


@pytest.mark.parametrize("chosen", [[0, 1, 2], [2], [1, 0]])
@pytest.mark.parametrize("name", ["bend", "growing", "equal", "two parts", "no faces"])
def test_sweeps_without_volumes_go_on_from_where_those_with_volumes_look_at_them(name: str, chosen: list[int]) -> None:
    path = path_of(*PAIRS[name])[1]
    wanted = [path._wanted(time, None) for time in (0.2, 0.5, 0.7)]
    first = sweeps.Sweeps(path._surface, wanted)
    first.settled(13)
    few = [wanted[shape] for shape in chosen]
    whole = sweeps.Sweeps(path._surface, few, holds_volumes=False).settled(13)
    if first.branch is None:  # nothing is closed, or nothing moves
        assert name in ("equal", "no faces")
        return
    for _ in range(2):  # what was begun can be used again
        begun = first.branch.of(chosen)
        again = sweeps.Sweeps(path._surface, few, holds_volumes=False).settled(13, begun)
        np.testing.assert_array_equal(again, whole)
