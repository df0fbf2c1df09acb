# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A tube with two joints, posed by linear-blend skinning: what both joints together should look like is known."""

from __future__ import annotations

import numpy as np

from qc3d_addon.solver.arrays import Floats, Ints

SHOULDER, ELBOW = 1.0, 2.5


def arm(rings: int = 41, around: int = 16) -> tuple[Floats, Ints]:
    """A closed tube of length 4 along x, radius 0.3: vertices and triangles whose normals point out."""
    turn, along = np.meshgrid(np.arange(around) * 2.0 * np.pi / around, np.linspace(0.0, 4.0, rings))
    tube = np.stack([along, 0.3 * np.cos(turn), 0.3 * np.sin(turn)], axis=2).reshape(-1, 3)
    ring, start = np.arange(around), around * np.arange(rings - 1)[:, None]
    a, b = start + ring, start + np.roll(ring, -1)
    first, last = len(tube), len(tube) + 1
    ends = [[first, later, now] for now, later in zip(ring, np.roll(ring, -1), strict=True)]
    top = around * (rings - 1)
    ends += [[last, top + now, top + later] for now, later in zip(ring, np.roll(ring, -1), strict=True)]
    sides = np.concatenate([np.stack([a, b, b + around], axis=2), np.stack([a, b + around, a + around], axis=2)])
    points = np.concatenate([tube, [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]]])
    return points, np.concatenate([sides.reshape(-1, 3), np.array(ends)])[:, ::-1]


def posed(rest: Floats, raised: float, bent: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Floats:
    """The arm raised about z by an angle and its elbow bent by another one about an axis, degrees."""
    elbow = _skinned(rest, ELBOW, _rotation(np.array(axis), bent), rest)
    return _skinned(rest, SHOULDER, _rotation(np.array([0.0, 0.0, 1.0]), raised), elbow)


def _skinned(rest: Floats, joint: float, rotation: Floats, shape: Floats) -> Floats:
    weight = np.clip((rest[:, :1] - joint + 0.3) / 0.6, 0.0, 1.0)
    pivot = np.array([joint, 0.0, 0.0])
    return shape + weight * ((shape - pivot) @ rotation.T + pivot - shape)


def _rotation(axis: Floats, degrees: float) -> Floats:
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
