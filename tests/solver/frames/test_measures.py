# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Distortion at the vertices of every frame: known answers on scaled shapes, chains, and the worst place."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.frames.bake import Bake, evenly_spaced
from qc3d_addon.solver.frames.measures import worst_excess
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from ..baking import frames_of
from ..meshes import icosphere

NORMAL = FitOptions()
TURN = rotation_matrices(np.array([[0.3, -0.4, 0.5]]))[0]


def chain(*shapes: Floats, mode: str = "natural") -> Bake:
    """The bake with one in-between of every two shapes of the sphere."""
    faces = icosphere(2)[1]
    pairs = [KeyPair.checked(first, second, faces) for first, second in pairwise(shapes)]
    fitted = [finish(fit_pair(pair, NORMAL)) for pair in pairs]
    return frames_of(fitted, evenly_spaced(2 * len(pairs) - 1), mode)


def test_a_sphere_that_grows_and_turns() -> None:
    sphere = icosphere(2)[0] - 0.5
    measures = chain(sphere, 1.5 * sphere @ TURN.T).measures
    assert {name: values.shape for name, values in measures.items()} == dict.fromkeys(
        ("stretch", "volume", "dilatation"), (3, len(sphere))
    )
    np.testing.assert_allclose(measures["stretch"][0], 1.0, atol=1e-6)
    # The enclosed volume goes evenly from one key's to the other's.
    np.testing.assert_allclose(measures["stretch"][1], (0.5 + 0.5 * 1.5**3) ** (1 / 3), atol=0.005)
    np.testing.assert_allclose(measures["stretch"][2], 1.5, atol=1e-6)
    for name in ("volume", "dilatation"):
        np.testing.assert_allclose(measures[name][0], 1.0, atol=1e-5)
    # Inside, the map grows like the surface; coarse tetrahedra reach from there into the space that has to shrink.
    assert 0.65 < np.median(measures["volume"][2]) / 1.5**3 < 1.05
    assert np.median(measures["dilatation"][2]) < 1.5


@pytest.mark.parametrize("mode", ["natural", "linear"])
def test_all_is_measured_from_the_first_key_of_a_chain(mode: str) -> None:
    sphere = icosphere(2)[0] - 0.5
    wide = sphere * [1.3, 1.0, 1.0]
    measures = chain(sphere, wide @ TURN.T, sphere, mode=mode).measures
    np.testing.assert_allclose(measures["stretch"][[0, 4]], 1.0, atol=1e-6)
    assert measures["stretch"][2].max() > 1.25
    # There and back again: the second map nearly undoes the first.
    np.testing.assert_allclose(np.median(measures["volume"][4]), 1.0, atol=0.05)
    assert np.median(measures["dilatation"][4]) < 1.1
    assert np.median(measures["dilatation"][2]) > 1.15


class TestWorstExcess:
    def pair(self) -> KeyPair:
        points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 5.0, 5.0]])
        return KeyPair.checked(points, points * [2.0, 1.0, 1.0], [[0, 1, 2]])

    def test_within_the_keys(self) -> None:
        pair = self.pair()
        frames = np.stack([pair.key0, 0.5 * (pair.key0 + pair.key1), pair.key1])
        assert worst_excess(pair, frames).excess == pytest.approx(0.0, abs=1e-15)

    def test_longer_and_shorter(self) -> None:
        pair = self.pair()
        longer, shorter = pair.key1.copy(), pair.key0.copy()
        longer[1, 0] = 3.0  # the edge is 1 to 2 long in the keys
        shorter[2, 1] = 0.25  # and this one 1
        found = worst_excess(pair, np.stack([pair.key0, longer]))
        assert (found.excess, found.frame) == (pytest.approx(0.5), 1)
        found = worst_excess(pair, np.stack([longer, shorter, pair.key0]))
        assert (found.excess, found.frame) == (pytest.approx(0.75), 1)
        assert found.vertex in (0, 2)

    def test_no_edges(self) -> None:
        points = np.eye(3)
        pair = KeyPair.checked(points, points, np.empty((0, 3), dtype=np.int64))
        assert worst_excess(pair, points[None]).excess == 0.0
