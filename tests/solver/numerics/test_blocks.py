# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in blocks gives what work on everything gives, in the same layout."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.numerics import blocks
from qc3d_addon.solver.numerics.blocks import in_blocks
from qc3d_addon.solver.numerics.rotations import by_component


@pytest.mark.parametrize("count", [0, 1, 7, 20])
def test_blocks_are_put_together_in_order_and_layout(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(0).normal(size=(count, 3, 2))

    def work(rows: slice) -> tuple[Floats, ...]:
        return by_component(2.0 * values[rows]), values[rows, 0, 0] + 1.0

    monkeypatch.setattr(blocks, "_ROWS", 6)
    doubled, shifted = in_blocks(work, count)
    np.testing.assert_array_equal(doubled, 2.0 * values)
    np.testing.assert_array_equal(shifted, values[:, 0, 0] + 1.0)
    if count > 1:
        assert doubled.strides == by_component(2.0 * values).strides
