# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames stay out of fixed and moving colliders, and meet their keys all the same."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision.colliders import Collider, CollisionResolver, PosedCollider
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.frames.bake import Bake, evenly_spaced
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions, Mode
from qc3d_addon.solver.support.progress import finish

from ..baking import frames_of
from ..meshes import icosphere

TIMES = evenly_spaced(7)
SETTINGS = FitOptions()


def bulging(points: Floats) -> Floats:
    """A unit ball with a bulge of a quarter toward -y, as points (n, 3) of any length on their rays."""
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip(-rays[:, 1], -1.0, 1.0)))
    return np.asarray(rays * (1.0 + 0.25 * np.maximum(1.0 - (angle / 30.0) ** 2, 0.0) ** 2)[:, None])


def eyeball() -> tuple[Floats, Ints]:
    points, faces = icosphere(3)
    return bulging(points - 0.5), faces


def lid(margin: float) -> tuple[Floats, Ints]:
    """A lid between its crease and its margin (degrees above the middle), 2 % of the radius off the eyeball."""
    rows, columns = 14, 21
    down, across = np.linspace(0.0, 1.0, rows)[:, None], np.linspace(-1.0, 1.0, columns)[None]
    latitude = np.radians((70.0 + (margin - 70.0) * down) * (1.0 - across**2))
    longitude = np.radians(62.0) * (across + 0.0 * down)
    rays = np.stack(
        [np.cos(latitude) * np.sin(longitude), -np.cos(latitude) * np.cos(longitude), np.sin(latitude)], axis=-1
    ).reshape(-1, 3)
    numbers = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return bulging(rays) + 0.02 * rays, faces


OPEN, FACES = lid(38.0)
CLOSED = lid(-15.0)[0]
TURN = rotation_matrices(np.array([[0.3, 1.0, -0.5]]))[0]


def bake(key0: Floats, key1: Floats, collider: Collider | None, mode: str = "natural") -> Bake:
    fitted = finish(fit_pair(KeyPair.checked(key0, key1, FACES), SETTINGS))
    return frames_of(fitted, TIMES, mode, collider=collider)


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "shift", "turn"), [(1.0, 0.0, np.eye(3)), (37.0, 100.0, TURN)])
def test_a_lid_goes_over_the_eyeball(scale: float, shift: float, turn: Floats) -> None:
    eye, eye_faces = eyeball()
    place = lambda points: scale * points @ turn.T + shift  # noqa: E731
    collider = Collider.checked(np.stack([place(eye)] * 2), eye_faces)
    fixed = PosedCollider(collider, np.broadcast_to(place(eye), (len(TIMES), *eye.shape)))
    key0, key1 = place(OPEN), place(CLOSED)
    straight = fixed.crossings(np.array([(1.0 - time) * key0 + time * key1 for time in TIMES]), FACES)
    without = bake(key0, key1, None)
    found = bake(key0, key1, collider)
    assert straight[0] == straight[-1] == 0
    assert max(straight) > 50
    assert max(fixed.crossings(without.frames, FACES)) > 20
    assert found.report.collider_crossings == [0] * len(TIMES)
    assert fixed.crossings(found.frames, FACES) == [0] * len(TIMES)
    assert found.report.crossings == [0] * len(TIMES)
    np.testing.assert_array_equal(found.frames[0], key0)
    np.testing.assert_array_equal(found.frames[-1], key1)
    # The corners and the crease that both keys leave in place stay there, and lengths hold about as well as they can.
    still = np.linalg.norm(key1 - key0, axis=1) == 0.0
    assert still.any()
    assert (found.frames[:, still] == key0[still]).all()
    assert found.report.worst_stretch.excess < 0.2


def test_a_collider_far_away_changes_nothing() -> None:
    eye, eye_faces = eyeball()
    found = bake(OPEN, CLOSED, Collider.checked(np.stack([eye - 50.0] * 2), eye_faces))
    np.testing.assert_array_equal(found.frames, bake(OPEN, CLOSED, None).frames)


def test_a_collider_that_moves() -> None:
    # The eyeball looks aside while the lid closes: seen from the eyeball, the lid's keys are turned.
    eye, eye_faces = eyeball()
    aside = rotation_matrices(np.array([[0.0, 0.0, 0.6]]))[0]
    collider = Collider.checked(np.stack([eye, eye @ aside.T]), eye_faces)
    assert collider.moves
    key1 = bulging(CLOSED @ aside) @ aside.T + 0.02 * CLOSED / np.linalg.norm(CLOSED, axis=1, keepdims=True)
    found = bake(OPEN, key1, collider)
    assert found.report.collider_crossings == [0] * len(TIMES)


def test_what_a_key_has_inside_stays_as_deep_and_is_told() -> None:
    eye, eye_faces = eyeball()
    collider = Collider.checked(np.stack([eye] * 2), eye_faces)
    sunk = CLOSED * 0.97
    found = bake(OPEN, sunk, collider)
    counts = found.report.collider_crossings
    assert counts[0] == 0 < counts[-1]
    assert any("crosses the colliders in" in note for note in found.report.notes)
    np.testing.assert_array_equal(found.frames[-1], sunk)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["natural", "linear", "straight"])
@pytest.mark.parametrize("moves", [False, True])
def test_every_mode_keeps_clear_of_colliders(mode: Mode, moves: bool) -> None:
    eye, eye_faces = eyeball()
    collider = Collider.checked(np.stack([eye, 0.99 * eye if moves else eye]), eye_faces)
    assert collider.moves == moves
    found, without = bake(OPEN, CLOSED, collider, mode), bake(OPEN, CLOSED, None, mode)
    assert without.report.collider_crossings is None
    crossings = PosedCollider(collider, np.broadcast_to(eye, (len(TIMES), *eye.shape))).crossings(without.frames, FACES)
    assert max(found.report.collider_crossings) < 0.1 * max(crossings)
    np.testing.assert_array_equal(found.frames[0], OPEN)
    np.testing.assert_array_equal(found.frames[-1], CLOSED)


def test_the_resolver_keeps_what_the_keys_keep_but_no_more_than_needed() -> None:
    eye, eye_faces = icosphere(3)
    posed = PosedCollider(Collider.checked(np.stack([eye - 0.5] * 2), eye_faces), np.stack([eye - 0.5] * 3))
    points = np.array([[0.0, 0.0, 0.4], [0.0, 0.4, 0.0], [0.9, 0.0, 0.0], [1.0, 1.0, 1.0]])
    pair = KeyPair.checked(points, points * 1.1, [[0, 1, 2]])
    resolver = CollisionResolver(posed, pair, 0, np.array([0, 1, 2]))
    near, moved = resolver.pushed(1, points * 0.7, 0.5)
    np.testing.assert_array_equal(near, [True, True, False, False])
    kept = np.linalg.norm(moved, axis=1) - 0.3
    triangle = points[:3]
    edges = np.linalg.norm(triangle - np.roll(triangle, 1, axis=0), axis=1).mean()
    np.testing.assert_allclose(kept[:2], np.minimum([0.12, 0.12], 0.25 * edges), atol=2e-3)
    assert not resolver.pushed(0, points, 0.0)[0].any()
    assert not resolver.pushed(2, points * 1.1, 1.0)[0].any()


@pytest.mark.parametrize(
    ("shapes", "faces", "sentence"),
    [
        (np.zeros((2, 3)), [[0, 1, 2]], "for every key"),
        (np.full((2, 3, 3), np.nan), [[0, 1, 2]], "not finite"),
        (np.zeros((2, 3, 3)), np.empty((0, 3), dtype=int), "no triangles"),
        (np.zeros((2, 3, 3)), [[0, 1, 3]], "no vertex"),
    ],
)
def test_arrays_that_are_no_collider(shapes: Floats, faces: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        Collider.checked(shapes, faces)  # type: ignore[arg-type]


def test_several_colliders_are_one() -> None:
    eye, faces = icosphere(1)
    parts = [Collider.checked(np.stack([eye + shift] * 2), faces) for shift in (0.0, 5.0)]
    joined = Collider.joined(parts)
    assert not joined.moves
    np.testing.assert_array_equal(joined.shapes[0], np.concatenate([eye, eye + 5.0]))
    np.testing.assert_array_equal(joined.faces, np.concatenate([faces, faces + len(eye)]))
