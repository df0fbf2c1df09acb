# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The keys that the sheets of easily mistaken kinds of meshes are made of."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.kinds import KINDS, bird, box
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.triangles.closed_volume import ClosedComponents


@pytest.mark.parametrize("kind", KINDS)
def test_lengths_are_the_same_in_both_keys(kind: str) -> None:
    """So whatever shrinks in between is the fault of the in-betweens."""
    key0, key1, faces = KINDS[kind][0]()
    KeyPair.checked(key0, key1, faces)
    spans = [key[faces] - key[np.roll(faces, 1, axis=1)] for key in (key0, key1)]
    lengths = [np.linalg.norm(span, axis=2) for span in spans]
    np.testing.assert_allclose(*lengths, rtol=1e-3)
    assert np.abs(key1 - key0).max() > 0.5


def test_the_bird_is_symmetric_and_boxes_face_outward() -> None:
    down, up, _ = bird()
    for key in (down, up):
        images = np.linalg.norm(key[:, None] * [-1.0, 1.0, 1.0] - key[None], axis=2)
        assert images.min(axis=1).max() < 1e-12
    corners, faces = box((1.0, 2.0, 3.0))
    assert ClosedComponents(faces, np.zeros(8, dtype=np.int64)).volumes(corners) == pytest.approx([6.0])
