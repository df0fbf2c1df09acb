# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles that cross at a common vertex."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.collision import crossings_at_vertices as module
from qc3d_addon.solver.collision.box_tree import CrowdedError
from qc3d_addon.solver.collision.crossings import crossing_pairs
from qc3d_addon.solver.collision.crossings_at_vertices import crossings_at_vertices

from ..meshes import icosphere


def fan(count: int) -> tuple[Floats, Ints]:
    """A pointed hat: triangles around one vertex."""
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    order = np.arange(1, count + 1)
    faces = np.stack([np.zeros(count, dtype=np.int64), order, np.roll(order, -1)], axis=1)
    return np.concatenate([[[0.0, 0.0, 1.0]], rim]), faces


def test_a_hat_whose_side_is_pushed_through_the_other() -> None:
    points, faces = fan(8)
    assert not len(crossings_at_vertices(points, faces))
    points[1] = [-1.4, 0.0, 0.2]  # past the fifth corner of the rim, which is opposite
    found = crossings_at_vertices(points, faces)
    assert len(found)
    assert np.isin(found, [0, 7]).any(axis=1).all()
    # The edges that cross meet triangles with which they share the tip, so no other search finds them.
    assert not len(crossing_pairs(points, faces))


def test_neither_where_they_are_moved_nor_how_large_they_are_matters() -> None:
    points, faces = fan(8)
    points[1] = [-1.4, 0.0, 0.2]
    expected = crossings_at_vertices(points, faces)
    for scale, shift in ((1e-3, 0.0), (1e3, 5.0), (1.0, 1e3)):
        np.testing.assert_array_equal(crossings_at_vertices(scale * points + shift, faces), expected)


def test_a_clean_surface_has_none_also_when_it_is_flattened() -> None:
    points, faces = icosphere(2)
    assert not len(crossings_at_vertices(points, faces))
    assert not len(crossings_at_vertices(points * [1.0, 1.0, 0.0], faces))
    assert not len(crossings_at_vertices(points, faces[:0]))


def test_pairs_are_the_same_however_many_are_looked_at_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    points, faces = fan(8)
    points[1] = [-1.4, 0.0, 0.2]
    expected = crossings_at_vertices(points, faces)
    monkeypatch.setattr(module, "_AT_ONCE", 7)
    np.testing.assert_array_equal(crossings_at_vertices(points, faces), expected)


def test_too_many_triangles_around_a_vertex_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MOST", 50)
    with pytest.raises(CrowdedError):
        crossings_at_vertices(*fan(8))
