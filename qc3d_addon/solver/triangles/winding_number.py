# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Generalized winding numbers: inside and outside, also of open, self-crossing and multi-part meshes."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.grouped_sums import means_by_label, sums_by_label
from ..support.threads import in_threads
from .geometry import face_normals

OUTSIDE_WEIGHT = 1e-3  # small beside the inside's weight of 1, but enough to keep the system well conditioned

_MOST_DIPOLES = 2_500  # clusters of triangles are then about as large as the tetrahedra at the surface
_CHUNK = 128  # queries at once: few enough that their distances to all dipoles stay in the processor's cache
_MOST_ANGLES = 200_000  # at once
_ROUNDING = 1e-14  # of squared distances in the unit cube


def winding_numbers(points: Floats, faces: Ints, queries: Floats) -> Floats:
    """Generalized winding numbers of a triangle mesh at query points.

    Each triangle acts as a dipole; large meshes are clustered into few dipoles (the first-order expansion of Barill et
    al.). Values are therefore approximate closer to the surface than the size of a triangle or cluster, and accurate
    farther away.

    Parameters
    ----------
    points : (n, 3)
        Vertices in cube units.
    faces : (m, 3) int64
        Triangles; the surface may be open, cross itself, or have many parts.
    queries : (k, 3)
        Where to evaluate, in cube units.

    Returns
    -------
    (k,)
        About 1 inside a closed surface whose normals point out, 0 outside, and values between near holes.

    References
    ----------
    Jacobson et al., "Robust inside-outside segmentation using generalized winding numbers", 2013. Barill et al., "Fast
    winding numbers for soups and clouds", 2018.
    """
    centers, normals = _dipoles(points, faces)
    areas = np.linalg.norm(normals, axis=1)
    # A disk of the dipole's area softens the singularity at its center, where rounding of squares must not matter.
    softening = np.maximum(areas / np.pi, _ROUNDING)
    moments = np.column_stack([normals, np.einsum("ij,ij->i", normals, centers)])
    # All squared distances as one matrix product: (q, |q|^2, 1) times (-2 c, 1, |c|^2 + softening).
    dipoles = np.vstack([-2.0 * centers.T, np.ones(len(centers)), (centers**2).sum(axis=1) + softening])

    def summed(query: Floats) -> Floats:
        squares = np.column_stack([query, (query**2).sum(axis=1), np.ones(len(query))]) @ dipoles
        squares *= np.sqrt(squares)
        sums = np.reciprocal(squares, out=squares) @ moments
        return np.asarray(sums[:, 3] - np.einsum("ij,ij->i", query, sums[:, :3]))

    chunks = (queries[begin : begin + _CHUNK] for begin in range(0, len(queries), _CHUNK))
    return np.asarray(np.concatenate([np.empty(0), *in_threads(summed, chunks)]) / (4.0 * np.pi))


def exact_winding_numbers(points: Floats, faces: Ints, queries: Floats, without: Ints | None = None) -> Floats:
    """Winding numbers as sums of solid angles: exact up to rounding, however close to the surface; for few queries.

    Parameters
    ----------
    points : (n, 3)
    faces : (m, 3) int64
    queries : (k, 3)
    without : (k,) int64, optional
        For each query, a triangle that does not count, or -1. Without the triangle that it lies on, a query on a closed
        surface gets the mean of both sides, such as 0.5.

    Returns
    -------
    (k,)

    References
    ----------
    van Oosterom & Strackee, "The solid angle of a plane triangle", 1983.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> exact_winding_numbers(corners, faces, np.array([[0.1, 0.1, 0.1], [1.0, 1.0, 1.0]])).round(9) + 0.0
    array([1., 0.])
    """
    corners = points[faces]
    left_out = np.full(len(queries), -1) if without is None else without
    found = np.zeros(len(queries))
    step = max(1, _MOST_ANGLES // max(1, len(faces)))
    for begin in range(0, len(queries), step):
        rows = slice(begin, begin + step)
        first, second, third = np.moveaxis(corners[None] - queries[rows, None, None], 2, 0)
        sizes = [np.linalg.norm(way, axis=2) for way in (first, second, third)]
        volume = np.einsum("qma,qma->qm", first, np.cross(second, third))
        base = (
            sizes[0] * sizes[1] * sizes[2]
            + np.einsum("qma,qma->qm", first, second) * sizes[2]
            + np.einsum("qma,qma->qm", second, third) * sizes[0]
            + np.einsum("qma,qma->qm", third, first) * sizes[1]
        )
        angles = 2.0 * np.arctan2(volume, base)
        known = np.flatnonzero(left_out[rows] >= 0)
        angles[known, left_out[rows][known]] = 0.0
        found[rows] = angles.sum(axis=1) / (4.0 * np.pi)
    return found


def insideness(numbers: Floats) -> Floats:
    """(k,) weight of the volume at places with these winding numbers (k,): 1 inside, ``OUTSIDE_WEIGHT`` outside.

    It lies between near holes. The inside of a reversed surface (-1) and of nested surfaces (2) counts as inside too.
    """
    return np.asarray(np.clip(np.abs(numbers), OUTSIDE_WEIGHT, 1.0))


def _dipoles(points: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Centers and area vectors of at most about ``_MOST_DIPOLES`` clusters of neighboring triangles."""
    normals = 0.5 * face_normals(points, faces)
    centers = points[faces].mean(axis=1)
    if len(faces) <= _MOST_DIPOLES:
        return centers, normals
    areas = np.linalg.norm(normals, axis=1)
    cell = max(float(np.sqrt(2.0 * areas.sum() / _MOST_DIPOLES)), _ROUNDING)
    # Opposite triangles must not cancel, so the octant of the normal distinguishes clusters too.
    keys = np.column_stack([np.floor(centers / cell), normals > 0.0])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    return means_by_label(group, centers, areas), sums_by_label(group, normals)
