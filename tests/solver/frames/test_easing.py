# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Easing curves: fixed ends, monotonic, slow where they should be."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from qc3d_addon.solver.frames.easing import eased
from qc3d_addon.solver.settings import Easing

TIMES = np.linspace(0.0, 1.0, 101)


@pytest.mark.parametrize("easing", get_args(Easing))
def test_ends_stay_and_nothing_goes_backwards(easing: Easing) -> None:
    way = eased(TIMES, easing)
    assert way[0] == 0.0
    assert way[-1] == 1.0
    assert (np.diff(way) > 0.0).all()


@pytest.mark.parametrize(
    ("easing", "slow_start", "slow_end"),
    [("linear", False, False), ("ease-in", True, False), ("ease-out", False, True), ("ease-in-out", True, True)],
)
def test_slow_where_the_name_says(easing: Easing, slow_start: bool, slow_end: bool) -> None:
    speed = np.diff(eased(TIMES, easing)) / np.diff(TIMES)
    assert (speed[0] < 0.05) == slow_start
    assert (speed[-1] < 0.05) == slow_end


def test_in_and_out_mirror_each_other() -> None:
    np.testing.assert_allclose(eased(TIMES, "ease-in"), 1.0 - eased(1.0 - TIMES, "ease-out"), atol=1e-15)
