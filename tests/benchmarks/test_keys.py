# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of many keys: its keys, and one small measurement from end to end."""

from __future__ import annotations

import numpy as np

from benchmarks import keys
from benchmarks.stage_cases import limb


def test_keys_are_parts_of_shapes() -> None:
    base = np.random.default_rng(0).uniform(size=(50, 3))
    shape = base + [0.0, 0.0, 1.0]
    made = keys.parts_of(base, [shape], 7)
    assert len(made) == 7
    np.testing.assert_array_equal(made[0], shape)
    np.testing.assert_allclose(made[1] + made[2], base + shape, atol=1e-12)  # the two sides
    np.testing.assert_allclose(made[5], base + 0.8 * (shape - base), atol=1e-12)
    faces, sphere, _ = limb(300)
    assert len(keys.caps_of(sphere, 3)) == 3
    assert len(faces)


def test_a_run_and_single_bakes_are_measured() -> None:
    faces, sphere, _ = limb(200)
    text = keys.measured("sphere", faces, sphere, keys.caps_of(sphere, 2))
    run, single, seeded = ([cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()[2:5])
    assert run[:3] == ["sphere, 200 vertices", "2", "in one run"]
    assert all(float(cell) > 0.0 for cell in run[3:])
    assert all(float(cell) > 0.0 for cell in single[3:6])
    assert float(run[-1]) < 1e-2
    assert float(seeded[-1]) < 1e-2
