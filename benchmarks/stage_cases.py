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
SMALL = (
    *("box:8", "limb:20", "limb:100", "limb:400", "limb:800"),
    *("page:9", "page:100", "page:400", "page:784", "half limb:200", "half limb:800", "limbs:200", "limbs:800"),
)

_STRETCH = 3.0
_BEND = np.radians(100.0)
_LIMBS = 20


def load(case: str) -> tuple[Ints, Floats, Floats]:
    """Triangles, first and second shape of a case: ``body:rest:t_pose``, or ``limb:10000`` with 10,000 vertices.

    Other kinds are a twisted box, a page that bends, a limb one half of which is still, and twenty limbs.
    """
    if case.count(":") == 2:
        file, first, second = case.split(":")
        return Pair(file, first, second).load()
    kind, count = case.split(":")
    made = {"limb": limb, "box": twisted_box, "page": page, "half limb": half_limb, "limbs": limbs}
    return made[kind](int(count))


def twisted_box(count: int) -> tuple[Ints, Floats, Floats]:
    """The eight corners of a box, which is twisted and stretched; ``count`` is 8."""
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij")).reshape(3, count).T
    faces = ConvexHull(corners).simplices.astype(np.int64)
    inward = np.einsum("ij,ij->i", face_normals(corners, faces), corners[faces].mean(axis=1)) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    cosine, sine = np.cos(0.6 * corners[:, 2]), np.sin(0.6 * corners[:, 2])
    x, y, z = corners.T
    return faces, corners, np.stack([cosine * x - sine * y, sine * x + cosine * y, 1.4 * z], axis=1)


def page(count: int) -> tuple[Ints, Floats, Floats]:
    """A square grid of ``count`` vertices, a square number, that bends into an arc."""
    side = round(count**0.5)
    x, y = (place.ravel() for place in np.meshgrid(*[np.linspace(0.0, 1.0, side)] * 2, indexing="ij"))
    number = np.arange(side**2).reshape(side, side)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    arc = np.stack([0.5 * np.sin(2.0 * x), y, 0.5 - 0.5 * np.cos(2.0 * x)], axis=1)
    return faces, np.stack([x, y, np.zeros_like(x)], axis=1), arc


def half_limb(count: int) -> tuple[Ints, Floats, Floats]:
    """A sphere whose lower part is still, while its upper part leans over."""
    faces, sphere, _ = limb(count)
    leaning = sphere.copy()
    leaning[:, 0] += np.sin(np.maximum(sphere[:, 2] + 0.2, 0.0))
    return faces, sphere, leaning


def limbs(count: int) -> tuple[Ints, Floats, Floats]:
    """Twenty limbs in a row, with ``count`` vertices together."""
    faces, sphere, bent = limb(count // _LIMBS)
    along = 3.0 * np.arange(_LIMBS)[:, None, None] * [1.0, 0.0, 0.0]
    every = (faces + len(sphere) * np.arange(_LIMBS)[:, None, None]).reshape(-1, 3)
    return every, (sphere + along).reshape(-1, 3), (bent + along).reshape(-1, 3)


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
