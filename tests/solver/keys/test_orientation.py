# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrored and inside-out keys are told from all others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.keys.files import read_pair
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.keys.orientation import mirrored_share, require_reachable
from qc3d_addon.solver.numerics.rotations import rotation_matrices

from ..meshes import arced, box_surface, icosphere, twisted

BAR, FACES = box_surface((2, 2, 8), (1.0, 1.0, 5.0))
OPEN = FACES[BAR[FACES].mean(axis=1)[:, 2] > 1e-9]
BALL, BALL_FACES = icosphere(2, 1.0)
MIRROR = np.diag([-1.0, 1.0, 1.0])
TURN = rotation_matrices(np.array([[0.3, 0.9, -0.5]]))[0]
RANDOM = np.random.default_rng(0)
MIXED = np.where(np.arange(len(FACES))[:, None] % 2, FACES, FACES[:, ::-1])
CUP_OF_BAR = FACES[BAR[FACES].mean(axis=1)[:, 2] > 2.0]


def share(key0: Floats, key1: Floats, faces: Ints) -> float:
    return mirrored_share(KeyPair.checked(key0, key1, faces))


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1.0, 1e30])
@pytest.mark.parametrize("growth", [0.1, 1.0, 20.0])
def test_mirrored_and_turned_as_a_whole(scale: float, growth: float) -> None:
    lopsided = scale * (BAR + 0.3 * BAR[:, 2:] ** 2 * [0.1, 0.0, 0.0])
    assert share(lopsided, growth * lopsided @ MIRROR @ TURN.T + 3.0 * scale, FACES) == 1.0
    assert share(lopsided, -growth * lopsided, FACES) == 1.0
    assert share(lopsided, growth * lopsided @ TURN.T + 3.0 * scale, FACES) == 0.0


@pytest.mark.parametrize("faces", [FACES, OPEN, FACES[:, ::-1], MIXED])
@pytest.mark.parametrize(
    "key1",
    [BAR, arced(BAR, 1.5), twisted(BAR, 3.0), BAR * [3.0, 1.0, 0.1], BAR * [-1.0, -1.0, 1.0]],
    ids=["same", "bent", "twisted", "stretched", "half a turn"],
)
def test_not_mirrored(key1: Floats, faces: Ints) -> None:
    assert share(BAR, key1, faces) == 0.0
    assert share(BAR, key1 @ TURN.T, faces) == 0.0


@pytest.mark.parametrize("faces", [OPEN, CUP_OF_BAR, FACES[:1]])
def test_what_is_open_has_no_inside_to_turn_out(faces: Ints) -> None:
    # A leaf or a flag may well bend to its mirror image.
    for key1 in (BAR @ MIRROR, -BAR, BAR @ MIRROR @ TURN.T + 3.0):
        assert share(BAR, key1, faces) == 0.0


def test_points_and_wires_have_no_surface_to_mirror() -> None:
    cloud = RANDOM.normal(size=(50, 3))
    assert share(cloud, cloud @ MIRROR, np.empty((0, 3), dtype=np.int64)) == 0.0
    assert share(cloud, cloud @ MIRROR, np.array([[0, 0, 1]])) == 0.0


@pytest.mark.parametrize(("size", "refused"), [(0.5, False), (0.9, False), (1.2, True)])
def test_parts_count_by_their_surface(size: float, refused: bool) -> None:
    key0 = np.concatenate([BALL, size * BALL + [5, 0, 0]])
    key1 = np.concatenate([BALL, -size * BALL + [5, 0, 0]])
    pair = KeyPair.checked(key0, key1, np.concatenate([BALL_FACES, BALL_FACES + len(BALL)]))
    assert mirrored_share(pair) == pytest.approx(size**2 / (1.0 + size**2))
    if refused:
        with pytest.raises(InputError, match=r"162 vertices to which vertex 162 belongs.*Choose the mode straight"):
            require_reachable(pair)
    else:
        require_reachable(pair)


def test_no_real_pair_is_mirrored(data_folder: Path) -> None:
    for path in sorted(data_folder.glob("*.npz")):
        with np.load(path) as stored:
            names = stored["shape_names"].tolist()
        for name in names[1:]:
            assert mirrored_share(read_pair(path, names[0], name)) < 0.1, (path, name)


@pytest.mark.parametrize("seed", range(4))
def test_a_key_that_presses_the_mesh_flat_has_no_inside_to_turn_out(seed: int) -> None:
    """Rounding decides about the sign of its volume."""
    noise = np.random.default_rng(seed).uniform(-1e-5, 1e-5, BALL.shape)
    assert share(BALL, BALL * [1.0, 1.0, 0.0] + noise, BALL_FACES) == 0.0
    assert share(BALL * [1.0, 1.0, 0.0] + noise, BALL, BALL_FACES) == 0.0
