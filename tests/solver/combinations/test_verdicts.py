# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pairs of keys need a combination: told rightly, and quickly enough for all pairs of a face."""

from __future__ import annotations

import numpy as np

import qc3d_addon as qc3d

from .arm import arm, posed

REST, FACES = arm()
SIDE = (0.0, 1.0, 0.0)


def test_joints_of_a_chain_need_one() -> None:
    keys = [posed(REST, 80.0, 0.0), posed(REST, 0.0, 90.0, SIDE)]
    (verdict,) = qc3d.judge_pairs(REST, keys, FACES)
    assert not verdict.adding_is_right
    assert (verdict.first, verdict.second, verdict.outer) == (0, 1, 0)
    truth = posed(REST, 80.0, 90.0, SIDE)
    sum_off = np.linalg.norm(keys[0] + keys[1] - REST - truth, axis=1).max() / np.linalg.norm(np.ptp(REST, axis=0))
    assert abs(verdict.distance - sum_off) < 0.02 * sum_off
    assert "needs a combination" in verdict.text


def test_separate_places_and_small_motions_are_added() -> None:
    low, high, near = REST.copy(), REST.copy(), REST.copy()
    low[REST[:, 0] < 1.0, 1] *= 1.5
    high[REST[:, 0] > 3.0, 1] *= 0.7
    near[REST[:, 0] < 1.2, 2] += 0.002
    found = list(qc3d.judge_pairs(REST, [low, high, near], FACES))
    assert [verdict.text for verdict in found] == ["adding is right"] * 3
    assert found[0].distance == 0.0


def test_a_sum_that_crosses_itself_needs_one() -> None:
    """Two sheets one over the other: each key moves its own sheet, and together they go through each other."""
    grid = np.stack([*np.meshgrid(np.linspace(0.0, 1.0, 6), np.linspace(0.0, 1.0, 6)), np.zeros((6, 6))], axis=2)
    sheet = grid.reshape(-1, 3)
    cell = np.arange(30)[np.arange(30) % 6 < 5]
    faces = np.concatenate([np.stack([cell, cell + 1, cell + 7], axis=1), np.stack([cell, cell + 7, cell + 6], axis=1)])
    bulge = np.sin(np.pi * sheet[:, 0]) * np.sin(np.pi * sheet[:, 1])
    rest = np.concatenate([sheet, sheet * [1.0, 1.0, 0.0] + [0.03, 0.01, 0.4]])
    up, down = rest.copy(), rest.copy()
    up[:36, 2] += 0.3 * bulge
    down[36:, 2] -= 0.3 * bulge
    (verdict,) = qc3d.judge_pairs(rest, [up, down], np.concatenate([faces, faces + 36]))
    assert verdict.crossings
    assert not verdict.adding_is_right
    assert verdict.distance == 0.0


def test_only_the_pairs_that_are_asked_for() -> None:
    keys = [posed(REST, angle, 0.0) for angle in (10.0, 20.0, 30.0)]
    found = qc3d.judge_pairs(REST, keys, FACES, pairs=[(0, 2)])
    assert [(verdict.first, verdict.second) for verdict in found] == [(0, 2)]
