# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of in-betweens of any mesh: keys moved, turned and scaled alike; keys that differ by next to nothing."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from ..baking import frames_of
from ..meshes import bent, box_surface, icosphere, twisted

pytestmark = pytest.mark.usefixtures("coarse_volume")

BAR, BAR_FACES = box_surface((2, 2, 8), (1.0, 1.0, 4.0))
PLATE, PLATE_FACES = box_surface((12, 4, 1), (4.0, 1.0, 0.1))
CUBE, CUBE_FACES = box_surface((1, 1, 1), (1.0, 1.0, 1.0))
TIMES = [0.25, 0.5]


def frames(key0: Floats, key1: Floats, faces: Ints, polygons: Ints | None = None) -> Floats:
    pair = KeyPair.checked(key0, key1, faces, polygons=polygons)
    return frames_of(finish(fit_pair(pair, FitOptions())), TIMES).frames


def blob(seed: int) -> tuple[Floats, Floats, Ints]:
    """A ball and what random waves make of it."""
    random = np.random.default_rng(seed)
    points, faces = icosphere(1, 1.0)
    keys = [points - 0.5, points - 0.5]
    for _ in range(3):
        keys[1] = keys[1] + 0.25 * np.sin(1.5 * keys[1] @ random.normal(size=(3, 3)) + random.uniform(0.0, 6.0, 3))
    return keys[0], keys[1], faces


def flapping() -> tuple[Floats, Floats, Ints]:
    """A plate whose wings flap about its middle, and that is lifted by a thousandth."""
    up, down = PLATE.copy(), PLATE.copy()
    wing = np.maximum(np.abs(PLATE[:, 0]) - 0.3, 0.0)
    up[:, 2] += 0.7 * wing + 0.004
    down[:, 2] -= 0.7 * wing
    return down, up, PLATE_FACES


def one_still() -> tuple[Floats, Floats, Ints]:
    key0, key1, faces = blob(5)
    key1[7] = key0[7]
    return key0, key1, faces


def hinged(angle: float) -> tuple[Floats, Floats, Ints]:
    """A bar that turns about one of its edges."""
    hinge = BAR[np.argmin(BAR.sum(axis=1))]
    return BAR, (BAR - hinge) @ rotation_matrices(np.array([[angle, 0.0, 0.0]]))[0].T + hinge, BAR_FACES


PAIRS = {
    **{f"blob {seed}": blob(seed) for seed in range(4)},
    "flapping": flapping(),
    "one still": one_still(),
    "cube": (CUBE, CUBE * [1.0, 1.3, 2.0], CUBE_FACES),
    "twist": (BAR, twisted(BAR, 2.5), BAR_FACES),
    "bend": (BAR, bent(BAR, 2.5), BAR_FACES),
    "hinge": hinged(1.5),
}
HALF_TURNS = {"half a turn": (BAR, BAR * [1.0, -1.0, -1.0], BAR_FACES), "half a turn about an edge": hinged(np.pi)}


@pytest.mark.parametrize("name", [*PAIRS, *HALF_TURNS])
def test_frames_of_keys_moved_turned_and_scaled_are_moved_turned_and_scaled(name: str) -> None:
    key0, key1, faces = {**PAIRS, **HALF_TURNS}[name]
    random = np.random.default_rng(len(name))
    rotation = rotation_matrices(random.normal(size=(1, 3)))[0]
    scale, shift = float(np.exp(random.normal())), random.normal(size=3)
    moved = [scale * key @ rotation.T + shift for key in (key0, key1)]
    expected = scale * frames(key0, key1, faces) @ rotation.T + shift
    size = scale * np.linalg.norm(np.ptp(key0, axis=0))
    np.testing.assert_allclose(frames(*moved, faces), expected, rtol=0.0, atol=1e-9 * size)


@pytest.mark.parametrize("name", PAIRS)
def test_a_millionth_changes_frames_by_a_ten_thousandth_at_most(name: str) -> None:
    key0, key1, faces = PAIRS[name]
    size = float(np.linalg.norm(np.ptp(key0, axis=0)))
    random = np.random.default_rng(len(name))
    polygons = KeyPair.checked(key0, key1, faces).polygons
    before = frames(key0, key1, faces, polygons)
    calmest = np.argmin(np.linalg.norm(key1 - key0, axis=1))
    one, every = np.zeros_like(key1), random.uniform(-0.5, 0.5, key1.shape)
    one[calmest] = [0.0, 0.0, 1.1]
    for change in (one, every):
        after = frames(key0, key1 + 1e-6 * size * change, faces, polygons)
        assert np.linalg.norm(after - before, axis=2).max() < 1e-4 * size
