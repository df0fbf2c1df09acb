# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface that is worked on in pieces, as large ones are."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.surface import path, pieces, volumes
from qc3d_addon.solver.surface.end_rates import Rates
from qc3d_addon.solver.surface.path import SurfacePath
from qc3d_addon.solver.surface.pieces import pieces_of
from qc3d_addon.solver.triangles.geometry import hat_gradients, tangent_bases

from ..meshes import bent, box_surface

BAR, FACES = box_surface((2, 2, 12), (1.0, 1.0, 5.0))


def test_small_pieces_have_the_gradients_and_loads_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    points, faces = BAR, FACES
    hats = hat_gradients(points, faces, tangent_bases(points, faces))
    (whole,) = pieces_of(faces, hats, len(points))
    monkeypatch.setattr(pieces, "TRIANGLES_IN_CACHE", 4)
    monkeypatch.setattr(pieces, "_TRIANGLES_OF_A_PIECE", 3)
    parts = pieces_of(faces, hats, len(points))
    assert len(parts) == -(-len(faces) // 3)
    random = np.random.default_rng(0)
    positions = random.normal(size=(3, 2, len(points)))
    vectors = random.normal(size=(3, 2, 2, len(faces)))
    stretch = random.normal(size=(2, len(faces), 2, 2))
    wanted, found = np.zeros_like(positions), np.zeros_like(positions)
    complete = whole.operator(slice(0, 2), stretch)
    complete.add_spread(vectors, wanted)
    gradients = complete.gradients(positions)
    for shape in range(2):
        for part in parts:
            operator = part.operator(slice(shape, shape + 1), stretch)
            of_part = operator.gradients(positions)[:, :, 0]
            np.testing.assert_allclose(of_part, gradients[:, :, shape, part.triangles], rtol=0.0, atol=1e-13)
            operator.add_spread(vectors[:, :, shape : shape + 1, part.triangles], found)
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-12)


def test_what_a_large_surface_gave_up_is_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    embedding = Embedding.of(KeyPair.checked(BAR, bent(BAR, 0.8), FACES))
    kept = SurfacePath(embedding)
    monkeypatch.setattr(path, "_MANY", 10)
    slim = SurfacePath(embedding)
    assert not len(slim.deformation.turns)
    for found, wanted in zip(slim.end_rates(), kept.end_rates(), strict=True):
        np.testing.assert_array_equal(found.spin, wanted.spin)
        np.testing.assert_array_equal(found.strain, wanted.strain)
        np.testing.assert_array_equal(found.growth, wanted.growth)
    first, second = kept.end_rates()
    doubled = Rates(2.0 * first.spin, first.strain, first.growth)
    np.testing.assert_array_equal(
        slim.with_end_rates(doubled, second).positions(0.4), kept.with_end_rates(doubled, second).positions(0.4)
    )


def test_the_path_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    embedding = Embedding.of(KeyPair.checked(BAR, bent(BAR, 0.8), FACES))
    wanted = SurfacePath(embedding).shapes([(0.3, None), (0.6, None)])
    monkeypatch.setattr(pieces, "TRIANGLES_IN_CACHE", 20)
    monkeypatch.setattr(pieces, "_TRIANGLES_OF_A_PIECE", 13)
    monkeypatch.setattr(volumes, "_TRIANGLES_AT_ONCE", 11)
    found = SurfacePath(embedding).shapes([(0.3, None), (0.6, None)])
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-11)
