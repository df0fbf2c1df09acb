# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes for timing: real pairs, and a sphere with any number of vertices that becomes a bent limb."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from qc3d_addon.solver.triangles.geometry import face_normals

from .catalogue import Floats, Ints, Pair

# Pairs with a time limit: for each engine, the largest allowed ratio of a cold bake to the yardstick.
LIMITS = {
    "body:rest:t_pose": {"delaunay": 0.15, "tetwild": 0.6},
    "head:neutral:jawOpen": {"delaunay": 0.15, "tetwild": 0.6},
    "body:rest:arms_overhead": {"delaunay": 0.3, "tetwild": 0.6},
    "horse:bind:Gallop_0": {"delaunay": 0.3, "tetwild": 0.6},
}
SIZES = (1_000, 10_000, 100_000, 200_000)

_STRETCH = 3.0
_BEND = np.radians(100.0)


def load(case: str) -> tuple[Ints, Floats, Floats]:
    """Triangles, first and second shape of a case: ``body:rest:t_pose``, or ``limb:10000`` with 10,000 vertices."""
    if case.startswith("limb:"):
        return limb(int(case.removeprefix("limb:")))
    file, first, second = case.split(":")
    return Pair(file, first, second).load()


def limb(count: int) -> tuple[Ints, Floats, Floats]:
    """A sphere with ``count`` vertices, and the limb that it becomes: stretched along z, then bent in its middle."""
    along = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    around = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    radius = np.sqrt(1.0 - along**2)
    sphere = np.stack([radius * np.cos(around), radius * np.sin(around), along], axis=1)
    faces = ConvexHull(sphere).simplices.astype(np.int64)
    inward = np.einsum("ij,ij->i", face_normals(sphere, faces), sphere[faces].mean(axis=1)) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    angle = 0.5 * _BEND * along
    length = _STRETCH / (0.5 * _BEND)
    x = length + sphere[:, 0] * 0.8
    bent = np.stack([x * np.cos(angle) - length, 0.8 * sphere[:, 1], x * np.sin(angle)], axis=1)
    return faces, sphere, bent
