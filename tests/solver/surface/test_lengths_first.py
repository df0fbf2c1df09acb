# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths take precedence over volumes, component by component."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Bools, Floats, Ints
from qc3d_addon.solver.surface.lengths_first import LengthsFirst
from qc3d_addon.solver.triangles.closed_volume import ClosedComponents
from qc3d_addon.solver.triangles.topology import sides, unique_edges

from ..meshes import icosphere


def _balls(parts: int) -> tuple[Floats, Ints, Ints]:
    """Positions, triangles and components of so many balls in a row, each with 642 vertices."""
    points, faces = icosphere(3, 1.0)
    every = np.concatenate([points + [3.0 * part, 0.0, 0.0] for part in range(parts)])
    triangles = np.concatenate([faces + len(points) * part for part in range(parts)])
    return every, triangles, np.repeat(np.arange(parts), len(points))


def _lengths_first(key0: Floats, key1: Floats, faces: Ints, labels: Ints, free: Bools) -> LengthsFirst:
    covering, springs = (faces, np.ones(len(faces))), np.empty((0, 2), dtype=np.int64)
    closed = ClosedComponents(faces, labels)
    return LengthsFirst(key0, key1, covering, springs, labels, closed, 0.5 * (key0 + key1), free)


@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize("share", [0.0, 0.005, 0.012, 0.3, 1.0])
def test_the_excess_is_the_99th_percentile_of_all_edges_of_a_component(parts: int, share: float) -> None:
    random = np.random.default_rng(0)
    key0, faces, labels = _balls(parts)
    edges = unique_edges(sides(faces))
    key1 = key0.copy()
    moved = random.permutation(len(key0))[: int(share * len(key0))]
    key1[moved] *= 1.01
    shape = 0.5 * (key0 + key1)
    shape[moved] *= random.uniform(1.0, 1.1, (len(moved), 1))
    free = np.zeros(len(key0), dtype=bool)
    lengths_first = _lengths_first(key0, key1, faces, labels, free)
    ends = [np.linalg.norm(key[edges[:, 1]] - key[edges[:, 0]], axis=1) for key in (key0, key1, shape)]
    excess = np.maximum(np.maximum(ends[2] / np.maximum(*ends[:2]) - 1.0, 1.0 - ends[2] / np.minimum(*ends[:2])), 0.0)
    wanted = [np.percentile(excess[labels[edges[:, 0]] == part], 99, method="higher") for part in range(parts)]
    found = lengths_first._excess(lengths_first._excesses(shape))
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-14)


def test_edges_that_come_back_after_a_full_turn_count_although_both_keys_leave_them_in_place() -> None:
    key0, faces, labels = _balls(1)
    shape, still = 1.05 * key0, np.zeros(len(key0), dtype=bool)
    of = [_lengths_first(key0, key0, faces, labels, free) for free in (still, ~still)]
    assert [one._excess(one._excesses(shape))[0] for one in of] == pytest.approx([0.0, 0.05])
