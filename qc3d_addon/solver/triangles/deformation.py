# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotation and in-plane stretch of each triangle from the first key to the second.

Each triangle has a deformation gradient between the keys, completed by its unit normals (Sumner & Popovic 2004,
"Deformation transfer for triangle meshes"). The surface pass interpolates its rotation and stretch and fits positions
to them by least squares (Xu et al. 2005, "Poisson shape interpolation"), then alternates between fitting rotations and
positions (Sorkine & Alexa 2007, "As-rigid-as-possible surface modeling").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.rotations import rotation_vectors
from ..numerics.symmetric_matrices import Stretch
from .geometry import face_normals, hat_gradients, planar_jacobians, tangent_bases

# Triangles whose area is less than this part of the largest have no usable directions in floating point. Nor do those
# whose height may be rounding alone: a few steps of single precision, in which Blender has its coordinates, at the
# largest coordinate. Three vertices in a line, as in a polygon with subdivided sides, make such triangles.
_THINNEST = 1e-10
_ROUNDING = 2.5e-7
# Nor do those that become flatter by this factor from one key to the other, as in a mesh that is pressed flat: there a
# millionth of the size would turn them by any angle.
_PRESSED = 1e-3


@dataclass(frozen=True, eq=False)
class TriangleDeformation:
    """Rotation and in-plane stretch of triangles between two keys, in local tangent bases.

    Build it with ``TriangleDeformation.between``.

    Parameters
    ----------
    faces : (m, 3) int64
        The usable triangles: those that have an area in both keys.
    weights : (m,)
        Weights in least-squares fits: proportional to the square root of the area, so that small triangles keep their
        lengths too. Their sum is the area of the surface in the first key.
    bases : (m, 3, 3)
        Columns: two tangents and the unit normal in the first key.
    gradients : (m, 3, 2)
        Gradients of the hat functions, in the tangent basis of the first key.
    stretch : Stretch
        Symmetric in-plane stretches (m, 2, 2) from the first key to the second.
    turns : (m, 3)
        Rotation vectors in radians, with angles in [0, pi].
    spins : (m, 2, 2)
        In-plane rotations from the tangents of the first key, carried along by the rotation, to those of the second.
    rows : (m,) int64
        Indices of these triangles in the whole mesh.
    """

    faces: Ints
    weights: Floats
    bases: Floats
    gradients: Floats
    stretch: Stretch
    turns: Floats
    spins: Floats
    rows: Ints

    @classmethod
    def between(
        cls, key0: Floats, key1: Floats, faces: Ints, shares: Floats | float = 1.0
    ) -> TriangleDeformation:
        """Deformation of the usable triangles of ``faces`` (m, 3) from ``key0`` (n, 3) to ``key1`` (n, 3).

        What they count is multiplied by ``shares`` (m,).
        """
        double0, double1 = (np.linalg.norm(face_normals(key, faces), axis=1) for key in (key0, key1))
        longest = [_longest_sides(key, faces) for key in (key0, key1)]
        usable = (double0 > _least_area(key0, double0, longest[0])) & (double1 > _least_area(key1, double1, longest[1]))
        flatness = np.stack([double0 * longest[1] ** 2, double1 * longest[0] ** 2])
        usable &= flatness.min(axis=0) > _PRESSED * flatness.max(axis=0)
        faces = faces[usable]
        bases0, bases1 = tangent_bases(key0, faces), tangent_bases(key1, faces)
        gradients = hat_gradients(key0, faces, bases0)
        planar = planar_jacobians(key1, faces, bases1, gradients)
        spin = _planar_rotations(planar)
        stretch = spin.transpose(0, 2, 1) @ planar
        stretch = 0.5 * (stretch + stretch.transpose(0, 2, 1))
        rotations = _lifted(bases1, spin) @ bases0.transpose(0, 2, 1)
        areas = 0.5 * (shares * double0)[usable]
        weights = np.sqrt(np.broadcast_to(shares, usable.shape)[usable] * areas)
        weights *= areas.sum() / max(float(weights.sum()), 1e-300)
        turns = rotation_vectors(rotations)
        return cls(faces, weights, bases0, gradients, Stretch.of(stretch), turns, spin, np.flatnonzero(usable))


def _longest_sides(key: Floats, faces: Ints) -> Floats:
    """(m,) length of the longest side of each triangle."""
    corners = key[faces]
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0))


def _least_area(key: Floats, double: Floats, longest: Floats) -> Floats:
    """(m,) bound that twice the area of a usable triangle must exceed.

    ``double`` (m,) is twice the areas, ``longest`` (m,) the longest sides.
    """
    rounding = _ROUNDING * float(np.abs(key).max(initial=0.0))
    return np.asarray(np.maximum(_THINNEST * double.max(initial=0.0), rounding * longest))


def _planar_rotations(planar: Floats) -> Floats:
    """(m, 2, 2) rotations closest to 2 x 2 matrices (m, 2, 2)."""
    cosine, sine = planar[:, 0, 0] + planar[:, 1, 1], planar[:, 1, 0] - planar[:, 0, 1]
    angle = np.arctan2(sine, cosine)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([cosine, -sine], axis=1), np.stack([sine, cosine], axis=1)], axis=1)


def _lifted(bases: Floats, spin: Floats) -> Floats:
    """(m, 3, 3) bases whose tangents are turned in their plane by ``spin`` (m, 2, 2)."""
    lifted = bases.copy()
    lifted[:, :, :2] = bases[:, :, :2] @ spin
    return lifted
