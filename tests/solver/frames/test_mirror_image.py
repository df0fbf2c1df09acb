# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetric keys have symmetric frames, however they are triangulated and wherever they stand."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.frames.mirror_image import MirrorImages
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from ..baking import frames_of
from ..meshes import box_surface, icosphere

pytestmark = pytest.mark.usefixtures("coarse_volume")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_symmetric_keys_have_symmetric_frames(kind: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    points, faces = icosphere(1, 1.0) if kind == "ball" else box_surface((4, 4, 6), (1.0, 1.0, 2.0))
    points = points - points.mean(axis=0)
    wave, phase = random.normal(size=3), random.uniform(0.0, 6.0)
    # Of the mirrored coordinate only the size matters, and it is scaled: both sides do the same.
    folded = points * [1.0, 1.0, 0.0] + np.abs(points) * [0.0, 0.0, 1.0]
    bend = np.sin(folded @ wave + phase)[:, None]
    key1 = points * (1.0 + 0.3 * bend) + 0.4 * bend * [1.0, 0.5, 0.0]
    mirrored = points * [1.0, 1.0, -1.0]
    partners = np.linalg.norm(points[None] - mirrored[:, None], axis=2).argmin(axis=1)
    np.testing.assert_allclose(key1[partners] * [1.0, 1.0, -1.0], key1, rtol=0.0, atol=1e-12)
    rotation, shift = rotation_matrices(random.normal(size=(1, 3)))[0], random.normal(size=3)
    pair = KeyPair.checked(points @ rotation.T + shift, key1 @ rotation.T + shift, faces)
    for frame in frames_of(finish(fit_pair(pair, FitOptions())), [0.25, 0.5]).frames:
        back = (frame - shift) @ rotation
        assert np.abs(back[partners] * [1.0, 1.0, -1.0] - back).max() < 1e-9 * pair.diagonal


def test_planes_are_found_where_both_keys_have_them() -> None:
    points, faces = box_surface((4, 6, 8), (1.0, 1.5, 2.0))
    points = points - points.mean(axis=0)
    bent = points + 0.2 * points[:, 2:] ** 2 * [1.0, 0.0, 0.0]
    leaning = points + 0.2 * points[:, 1:2] * points[:, 2:] * [1.0, 0.0, 0.0]
    twisted = leaning + 0.1 * np.sin(points @ [1.0, 2.0, 3.0])[:, None]
    for key1, normals in ((points, 3), (bent, 2), (leaning, 0), (twisted, 0)):
        found = MirrorImages(KeyPair.checked(points, key1, faces))
        assert len(found._planes) == normals
        for plane in found._planes:
            np.testing.assert_allclose(plane.image(key1), key1, rtol=0.0, atol=1e-4)
