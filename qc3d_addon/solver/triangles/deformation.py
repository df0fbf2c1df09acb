# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotation and in-plane stretch of each triangle from the first key to the second.

Each triangle has a deformation gradient between the keys, completed by its unit normals (Sumner & Popovic 2004,
"Deformation transfer for triangle meshes"). The surface pass interpolates its rotation and stretch and fits positions
to them by least squares (Xu et al. 2005, "Poisson shape interpolation"), then alternates between fitting rotations and
positions (Sorkine & Alexa 2007, "As-rigid-as-possible surface modeling").
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.blocks import in_blocks
from ..numerics.grouped_sums import means_by_label
from ..numerics.rising import risen
from ..numerics.rotations import rotation_vectors
from ..numerics.symmetric_matrices import Stretch
from .geometry import areas, hat_gradients, planar_jacobians, tangent_bases

# Triangles whose area is less than this part of the largest have no usable directions in floating point. Nor do those
# whose height may be rounding alone: a few steps of single precision, in which Blender has its coordinates, at the
# largest coordinate. Three vertices in a line, as in a polygon with subdivided sides, make such triangles.
_THINNEST = 1e-10
_ROUNDING = 2.5e-7
# Nor do those that become flatter by this factor from one key to the other, as in a mesh that is pressed flat: there a
# millionth of the size would turn them by any angle.
_PRESSED = 1e-3
_HARDLY_PRESSED = 1e-1  # gradually, from this factor on


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
        Columns: two tangents and the unit normal in the first key; empty where they are not needed any more.
    gradients : (m, 3, 2)
        Gradients of the hat functions, in the tangent basis of the first key; likewise.
    stretch : Stretch
        Symmetric in-plane stretches (m, 2, 2) from the first key to the second.
    turns : (m, 3)
        Rotation vectors in radians, with angles in [0, pi].
    angles : (m,)
        Of the in-plane rotations from the tangents of the first key, carried along by the rotation, to those of the
        second; radians.
    rows : (m,) int64
        Indices of these triangles in the whole mesh.
    """

    faces: Ints
    weights: Floats
    bases: Floats
    gradients: Floats
    stretch: Stretch
    turns: Floats
    angles: Floats
    rows: Ints

    @classmethod
    def between(cls, key0: Floats, key1: Floats, faces: Ints, shares: Floats | float = 1.0) -> TriangleDeformation:
        """Deformation of the usable triangles of ``faces`` (m, 3) from ``key0`` (n, 3) to ``key1`` (n, 3).

        What they count is multiplied by ``shares`` (m,).
        """
        double0, double1 = (2.0 * areas(key, faces) for key in (key0, key1))
        longest0, longest1 = (in_blocks(partial(_longest_among, key, faces), len(faces))[0] for key in (key0, key1))
        usable = (double0 > _least_area(key0, double0, longest0)) & (double1 > _least_area(key1, double1, longest1))
        usable &= _kept(double0 * longest1**2, double1 * longest0**2) > _PRESSED
        faces = faces if usable.all() else faces[usable]

        def parts(rows: slice) -> tuple[Floats, ...]:
            bases0, bases1 = tangent_bases(key0, faces[rows]), tangent_bases(key1, faces[rows])
            gradients = hat_gradients(key0, faces[rows], bases0)
            planar = planar_jacobians(key1, faces[rows], bases1, gradients)
            angles = np.arctan2(planar[:, 1, 0] - planar[:, 0, 1], planar[:, 0, 0] + planar[:, 1, 1])
            spin = _planar_rotations(angles)
            matrices = spin.transpose(0, 2, 1) @ planar
            stretch = Stretch.of(0.5 * (matrices + matrices.transpose(0, 2, 1)))
            turns = rotation_vectors(_lifted(bases1, spin) @ bases0.transpose(0, 2, 1))
            return bases0, gradients, stretch.values, stretch.vectors, turns, angles

        bases, gradients, values, vectors, turns, angles = in_blocks(parts, len(faces))
        sizes = 0.5 * (shares * double0)[usable]
        weights = np.sqrt(np.broadcast_to(shares, usable.shape)[usable] * sizes)
        weights *= sizes.sum() / max(float(weights.sum()), 1e-300)
        rows = np.flatnonzero(usable)
        return cls(faces, weights, bases, gradients, Stretch(values, vectors), turns, angles, rows)

    @property
    def spins(self) -> Floats:
        """(m, 2, 2) the in-plane rotations."""
        return _planar_rotations(self.angles)

    def weighing(self, factors: Floats) -> TriangleDeformation:
        """The same, with weights multiplied by ``factors`` (m,)."""
        return replace(self, weights=self.weights * factors)

    def without_directions(self) -> TriangleDeformation:
        """The same without bases and gradients, which take half of the memory."""
        return replace(self, bases=np.empty((0, 3, 3)), gradients=np.empty((0, 3, 2)))

    def without_motion(self) -> TriangleDeformation:
        """Only which triangles there are, and what they weigh."""
        nothing = Stretch(np.empty((0, 2)), np.empty((0, 2, 2)))
        return replace(self.without_directions(), stretch=nothing, turns=np.empty((0, 3)), angles=np.empty(0))


def pressed_shares(key0: Floats, key1: Floats, faces: Ints, shares: Floats, labels: Ints) -> Floats:
    """(components,) the part of each component's surface, 0..1, that is pressed flat in one key and not in the other.

    What is pressed flat is unusable for a ``TriangleDeformation``; what nearly is counts in part. ``labels`` (n,) are
    the components of the vertices, and ``shares`` (m,) what the triangles (m, 3) count.
    """
    double0, double1 = (2.0 * areas(key, faces) for key in (key0, key1))
    longest0, longest1 = (in_blocks(partial(_longest_among, key, faces), len(faces))[0] for key in (key0, key1))
    kept = _kept(double0 * longest1**2, double1 * longest0**2)
    depth = -np.log(np.clip(kept, _PRESSED, _HARDLY_PRESSED))
    degree = risen(depth, -np.log(_HARDLY_PRESSED), -np.log(_PRESSED))
    owners, count = labels[faces[:, 0]], int(labels.max(initial=-1)) + 1
    return means_by_label(owners, degree[:, None], shares * (double0 + double1), count)[:, 0]


def _kept(first: Floats, second: Floats) -> Floats:
    """(m,) the smaller of two positive numbers over the larger; 1 where both are zero."""
    most = np.maximum(first, second)
    return np.where(most > 0.0, np.minimum(first, second) / np.where(most > 0.0, most, 1.0), 1.0)


def _least_area(key: Floats, double: Floats, longest: Floats) -> Floats:
    """(m,) bound that twice the area of a usable triangle must exceed.

    ``double`` (m,) is twice the areas, ``longest`` (m,) the longest sides.
    """
    rounding = _ROUNDING * float(np.abs(key).max(initial=0.0))
    return np.asarray(np.maximum(_THINNEST * double.max(initial=0.0), rounding * longest))


def _longest_among(key: Floats, faces: Ints, rows: slice) -> tuple[Floats]:
    return (_longest_sides(key, faces[rows]),)


def _longest_sides(key: Floats, faces: Ints) -> Floats:
    """(m,) length of the longest side of each triangle."""
    corners = key[faces]
    spans = corners - corners[:, [2, 0, 1]]
    return np.asarray(np.sqrt(np.einsum("mij,mij->mi", spans, spans).max(axis=1, initial=0.0)))


def _planar_rotations(angles: Floats) -> Floats:
    """(m, 2, 2) rotations by angles (m,) in the plane, radians."""
    cosine, sine = np.cos(angles), np.sin(angles)
    return np.stack([np.stack([cosine, -sine], axis=1), np.stack([sine, cosine], axis=1)], axis=1)


def _lifted(bases: Floats, spin: Floats) -> Floats:
    """(m, 3, 3) bases whose tangents are turned in their plane by ``spin`` (m, 2, 2)."""
    lifted = bases.copy()
    lifted[:, :, :2] = bases[:, :, :2] @ spin
    return lifted
