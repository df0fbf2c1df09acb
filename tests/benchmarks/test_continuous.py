# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The continuous test of crossings between baked positions."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("ipctk", reason="the extra benchmark is not installed")

from benchmarks.continuous import meetings

FACES = np.array([[0, 1, 2], [3, 4, 5]])
LYING = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]])
STANDING = np.array([[1.0, 1.0, 1.0], [1.2, 1.0, 2.0], [1.0, 1.2, 2.0]])


def shapes(*places: tuple[float, float, float]) -> np.ndarray:
    """The lying triangle with the standing one moved to each place."""
    return np.stack([np.concatenate([LYING, STANDING + np.array(place)]) for place in places])


def test_what_passes_through_between_two_shapes() -> None:
    # Above at the start and below at the end: no shape crosses itself.
    through = meetings(shapes((0.0, 0.0, 0.0), (0.0, 0.0, -3.0)), FACES)
    assert {tuple(sorted(pair)) for pair in through.tolist()} == {(0, 1, 2, 3), (0, 1, 2, 4), (0, 1, 2, 5)}


def test_what_passes_by() -> None:
    by = meetings(shapes((0.0, 0.0, 0.0), (18.0, 0.0, -3.0)), FACES)
    assert len(meetings(shapes((0.0, 0.0, 0.0), (0.0, 0.0, -0.9)), FACES)) == 0
    assert len(by) == 0


def test_each_pair_counts_once() -> None:
    once = meetings(shapes((0.0, 0.0, 0.0), (0.0, 0.0, -3.0)), FACES)
    again = meetings(shapes(*[(0.0, 0.0, 0.0), (0.0, 0.0, -3.0)] * 3), FACES)
    np.testing.assert_array_equal(again, once)
