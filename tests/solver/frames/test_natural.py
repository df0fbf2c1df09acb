# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Natural in-betweens of the whole pipeline against known ones: bends, twists, limbs, extra turns, and time."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision.crossings import crossing_pairs
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.keys.embedding import RigidMotion
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.numerics.symmetric_matrices import Stretch
from qc3d_addon.solver.settings import FitOptions, StretchLaw
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.triangles.topology import sides, unique_edges

from ..baking import frames_of
from ..meshes import arced, bent, box_surface, enclosed_volume, icosphere, twisted

pytestmark = pytest.mark.usefixtures("coarse_volume")

LENGTH = 5.0
BAR, FACES = box_surface((2, 2, 16), (1.0, 1.0, LENGTH))
TIMES = [0.0, 0.2, 0.5, 0.8, 1.0]
NORMAL = FitOptions()


def baked(
    key0: Floats, key1: Floats, faces: Ints, times: list[float], extra_turns: int = 0, law: StretchLaw = "linear"
) -> Bake:
    choice = replace(NORMAL, stretch=law, extra_turns=extra_turns)
    fitted = finish(fit_pair(KeyPair.checked(key0, key1, faces), choice))
    bake = frames_of(fitted, times)
    assert not any(bake.report.folds.frames)
    return bake


def lengths(shape: Floats, faces: Ints) -> Floats:
    edges = unique_edges(sides(faces))
    return np.asarray(np.linalg.norm(shape[edges[:, 1]] - shape[edges[:, 0]], axis=1))


def distance_apart_from_place(shape: Floats, expected: Floats) -> float:
    """The largest distance after the rigid motion that brings the shapes together."""
    motion = RigidMotion.between(shape, expected, np.ones(len(shape)))
    return float(np.linalg.norm(motion.apply(shape) - expected, axis=1).max())


def turned_by_height(points: Floats, angles: Floats) -> Floats:
    turns = np.zeros_like(points)
    turns[:, 2] = angles
    return np.asarray(np.einsum("nij,nj->ni", rotation_matrices(turns), points))


def angles_about_z(shape: Floats, rest: Floats) -> Floats:
    """Angles, up to full turns, by which the rings of a bar, one at each height of ``rest``, have turned."""
    found = []
    for height in np.unique(rest[:, 2]):
        ring = rest[:, 2] == height
        first, second = (points[ring, :2] - points[ring, :2].mean(axis=0) for points in (rest, shape))
        across = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum()
        found.append(np.arctan2(across, (first * second).sum()))
    return np.array(found)


def around(angles: Floats) -> Floats:
    """Angles brought into -pi..pi."""
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi)


class TestAgainstExactInbetweens:
    @pytest.mark.parametrize("degrees", [90.0, 200.0, 300.0])
    def test_a_bent_bar(self, degrees: float) -> None:
        bake = baked(BAR, bent(BAR, np.radians(degrees)), FACES, TIMES)
        for time, frame in zip(TIMES[1:-1], bake.frames[1:-1], strict=True):
            exact = bent(BAR, time * np.radians(degrees))
            assert distance_apart_from_place(frame, exact) < 0.005 * LENGTH
            np.testing.assert_allclose(lengths(frame, FACES), lengths(exact, FACES), rtol=0.015)
            assert not len(crossing_pairs(frame, FACES))

    @pytest.mark.parametrize(("degrees", "part"), [(90.0, 0.01), (200.0, 0.03), (270.0, 0.05)])
    def test_a_twisted_bar(self, degrees: float, part: float) -> None:
        # The exact twist lets a triangle's edges shear past each other, which no rotation with stretch does.
        bake = baked(BAR, twisted(BAR, np.radians(degrees)), FACES, TIMES)
        for time, frame in zip(TIMES[1:-1], bake.frames[1:-1], strict=True):
            exact = twisted(BAR, time * np.radians(degrees))
            assert distance_apart_from_place(frame, exact) < part * LENGTH
            np.testing.assert_allclose(lengths(frame, FACES), lengths(exact, FACES), rtol=part)
            assert not len(crossing_pairs(frame, FACES))
            volume = enclosed_volume(BAR, FACES)
            assert enclosed_volume(frame, FACES) == pytest.approx(
                (1.0 - time) * volume + time * enclosed_volume(bake.frames[-1], FACES), rel=1e-9
            )

    def test_two_limbs_turn_opposite_ways(self) -> None:
        # The middle stays, both ends turn by 200 degrees: the short way would be 160 degrees back for both.
        height = np.clip(np.abs(BAR[:, 2] - 2.5) - 0.5, 0.0, 2.0) / 2.0 * np.sign(BAR[:, 2] - 2.5)
        angles = np.radians(200.0) * height
        bake = baked(BAR, turned_by_height(BAR, angles), FACES, TIMES)
        middle = height == 0.0
        rings = np.array([angles[BAR[:, 2] == level][0] for level in np.unique(BAR[:, 2])])
        for time, frame in zip(TIMES[1:-1], bake.frames[1:-1], strict=True):
            np.testing.assert_array_equal(frame[middle], BAR[middle])
            off = np.abs(around(angles_about_z(frame, BAR) - time * rings))
            assert np.degrees(off.max()) < 20.0
            exact = lengths(turned_by_height(BAR, time * angles), FACES)
            np.testing.assert_allclose(lengths(frame, FACES), exact, rtol=0.12)
            assert not len(crossing_pairs(frame, FACES))

    @pytest.mark.parametrize("law", ["linear", "logarithmic"])
    def test_growing_evenly(self, law: StretchLaw) -> None:
        ball, faces = icosphere(1)
        bake = baked(ball, 3.0 * ball, faces, TIMES, law=law)
        for time, frame in zip(TIMES, bake.frames, strict=True):
            # The volume goes linearly between the keys whatever the law, and leaves the lengths no choice.
            grown = (1.0 + 26.0 * time) ** (1.0 / 3.0)
            np.testing.assert_allclose(lengths(frame, faces), grown * lengths(ball, faces), rtol=0.01)


class TestExtraTurns:
    BAR, FACES = box_surface((2, 2, 20), (1.0, 1.0, LENGTH))
    SHARES = BAR[:, 2] / LENGTH
    KEY = turned_by_height(BAR, np.radians(450.0) * SHARES)

    def test_a_held_bar_twisted_by_more_than_a_turn(self) -> None:
        bake = baked(self.BAR, self.KEY, self.FACES, TIMES, extra_turns=1)
        rings = np.array([self.SHARES[self.BAR[:, 2] == level][0] for level in np.unique(self.BAR[:, 2])])
        for time, frame in zip(TIMES[1:-1], bake.frames[1:-1], strict=True):
            np.testing.assert_array_equal(frame[self.SHARES == 0.0], self.BAR[self.SHARES == 0.0])
            off = np.abs(around(angles_about_z(frame, self.BAR) - time * np.radians(450.0) * rings))
            assert np.degrees(off.max()) < 60.0
            exact = lengths(turned_by_height(self.BAR, time * np.radians(450.0) * self.SHARES), self.FACES)
            np.testing.assert_allclose(lengths(frame, self.FACES), exact, rtol=0.15)
            assert not len(crossing_pairs(frame, self.FACES))

    def test_otherwise_what_is_back_in_its_place_is_held(self) -> None:
        back = np.linalg.norm(self.KEY - self.BAR, axis=1) < 1e-6
        assert back[self.SHARES > 0.5].any()
        bake = baked(self.BAR, self.KEY, self.FACES, [0.5])
        np.testing.assert_allclose(bake.frames[0][back], self.BAR[back], rtol=0.0, atol=1e-6)

    @pytest.mark.parametrize("extra", [-1, 0, 2])
    def test_a_loose_part_gets_full_turns(self, extra: int) -> None:
        propeller, faces = box_surface((1, 1, 6), (0.5, 0.5, 2.5))
        middle = propeller.mean(axis=0)
        quarter = (propeller - middle) @ rotation_matrices(np.array([[0.5 * np.pi, 0.0, 0.0]]))[0].T + middle
        away = np.array([3.0, 0.0, 1.0])
        key0, key1 = (np.concatenate([BAR, part + away]) for part in (propeller, quarter))
        bake = baked(key0, key1, np.concatenate([FACES, faces + len(BAR)]), TIMES, extra)
        for time, frame in zip(TIMES, bake.frames, strict=True):
            angle = time * (0.5 * np.pi + 2.0 * np.pi * extra)
            expected = (propeller - middle) @ rotation_matrices(np.array([[angle, 0.0, 0.0]]))[0].T
            found = frame[len(BAR) :]
            np.testing.assert_allclose(found - found.mean(axis=0), expected, rtol=0.0, atol=0.002 * LENGTH)
            assert np.linalg.norm(found.mean(axis=0) - middle - away) < 0.02 * LENGTH
            np.testing.assert_array_equal(frame[: len(BAR)], BAR)

    def test_everything_turns_as_one(self) -> None:
        turn = np.array([0.6, -0.3, 0.9])
        key1 = RigidMotion(turn, np.array([3.0, 0.0, 1.0])).apply(BAR)
        bake = baked(BAR, key1, FACES, [0.5], extra_turns=1)
        axis = turn / np.linalg.norm(turn)
        half = rotation_matrices(0.5 * turn[None] + np.pi * axis)[0]
        frame = bake.frames[0]
        expected = (BAR - BAR.mean(axis=0)) @ half.T
        np.testing.assert_allclose(frame - frame.mean(axis=0), expected, rtol=0.0, atol=1e-9)

    def test_a_note_where_they_change_nothing(self) -> None:
        bake = baked(BAR, arced(BAR, 0.5), FACES, [0.5], extra_turns=1)
        assert any("extra turns change nothing" in note for note in bake.report.notes)
        plain = baked(BAR, arced(BAR, 0.5), FACES, [0.5])
        np.testing.assert_array_equal(bake.frames, plain.frames)


PAIRS = {
    "bent": (BAR, bent(BAR, np.radians(200.0)), FACES),
    "twisted and moved": (BAR, twisted(BAR, np.radians(250.0)) @ rotation_matrices(np.ones((1, 3)))[0] + 3, FACES),
    "half still": (BAR, arced(BAR, 2.0), FACES),
}


@cache
def prepared_once(name: str) -> FittedMap:
    return finish(fit_pair(KeyPair.checked(*PAIRS[name]), NORMAL))


def frames_at(name: str, times: list[float]) -> Floats:
    return frames_of(prepared_once(name), times).frames


class TestTime:
    @pytest.mark.parametrize("name", PAIRS)
    def test_no_jumps(self, name: str) -> None:
        times = np.linspace(0.0, 1.0, 33)
        frames = frames_at(name, times.tolist())
        steps = np.linalg.norm(np.diff(frames, axis=0), axis=2).max(axis=1)
        bends = np.linalg.norm(np.diff(frames, n=2, axis=0), axis=2).max(axis=1)
        # Of a smooth motion the second differences are as small as the square of the step.
        assert steps.max() < 3.0 * steps.mean()
        assert bends.max() < 20.0 * steps.mean() / 32.0

    @pytest.mark.parametrize("name", PAIRS)
    def test_close_times_give_close_frames(self, name: str) -> None:
        near = [0.0, 1e-6, 0.37, 0.37 + 1e-6, 1.0 - 1e-6, 1.0]
        frames = frames_at(name, near)
        for first in (0, 2, 4):
            assert np.abs(frames[first + 1] - frames[first]).max() < 1e-4

    @pytest.mark.parametrize("name", PAIRS)
    def test_a_time_alone_and_in_a_list(self, name: str) -> None:
        alone = frames_at(name, [0.37])[0]
        among = frames_at(name, [0.9, 0.37, 0.0, 0.37, 0.2])
        # To rounding: times are solved together.
        for frame in (among[1], among[3]):
            np.testing.assert_allclose(frame, alone, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("law", ["linear", "logarithmic"])
def test_stretches_of_what_is_flattened_into_a_line_stay_finite(law: StretchLaw) -> None:
    random = np.random.default_rng(0)
    lines = random.normal(size=(500, 2, 1)) * 10.0 ** random.uniform(-6.0, 6.0, size=(500, 1, 1))
    stretch = Stretch.of(np.concatenate([lines @ lines.transpose(0, 2, 1), np.zeros((1, 2, 2))]))
    for time in (0.0, 0.3, 1.0):
        with np.errstate(all="raise", under="ignore"):
            found = stretch.at(time, law)
        assert np.isfinite(found).all()
        assert np.linalg.eigvalsh(found).min() > -1e-3
