# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How often a surface winds around points: inside and outside for open, crossing and many-part meshes too."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from ..numerics.grouped_sums import means_by_label, sums_by_label
from ..support.threads import in_threads
from .geometry import face_normals

OUTSIDE_WEIGHT = 1e-3

_MOST_DIPOLES = 2_500  # groups of triangles are then about as large as the tetrahedra at the surface
# Queries at once: few enough that their distances to all dipoles stay in the processor's cache.
_CHUNK = 128
_ROUNDING = 1e-14  # of squared distances in the cube


def winding_numbers(points: Floats, faces: Ints, queries: Floats) -> Floats:
    """Generalised winding numbers (Jacobson et al. 2013) of a triangle mesh around query points.

    Triangles act as dipoles, many triangles as few dipoles (the first-order expansion of Barill et al. 2018, "Fast
    winding numbers for soups and clouds"), so values are approximate within about a triangle's or a cluster's size of
    the surface and accurate beyond.

    Parameters
    ----------
    points : (n, 3), faces : (m, 3)
        The surface, cube units; it may be open, overlap itself or be in many parts.
    queries : (k, 3)

    Returns
    -------
    (k,) about 1 inside a closed surface that faces outwards, 0 outside, in between near holes.
    """
    centres, normals = _dipoles(points, faces)
    areas = np.linalg.norm(normals, axis=1)
    # A disc of the dipole's area softens the singularity at its centre; rounding of the squares must not matter there.
    softening = np.maximum(areas / np.pi, _ROUNDING)
    moments = np.column_stack([normals, np.einsum("ij,ij->i", normals, centres)])
    # Squares of distances as one product, (q, |q|^2, 1) times (-2 c, 1, |c|^2 + softening).
    dipoles = np.vstack([-2.0 * centres.T, np.ones(len(centres)), (centres**2).sum(axis=1) + softening])

    def summed(query: Floats) -> Floats:
        squares = np.column_stack([query, (query**2).sum(axis=1), np.ones(len(query))]) @ dipoles
        squares *= np.sqrt(squares)
        sums = np.reciprocal(squares, out=squares) @ moments
        return np.asarray(sums[:, 3] - np.einsum("ij,ij->i", query, sums[:, :3]))

    chunks = (queries[begin : begin + _CHUNK] for begin in range(0, len(queries), _CHUNK))
    return np.asarray(np.concatenate([np.empty(0), *in_threads(summed, chunks)]) / (4.0 * np.pi))


def insideness(numbers: Floats) -> Floats:
    """(k,) what volume counts by its winding numbers: 1 inside, ``OUTSIDE_WEIGHT`` outside, in between near holes.

    Surfaces that are reversed (-1) or nested (2) have an inside all the same.
    """
    return np.asarray(np.clip(np.abs(numbers), OUTSIDE_WEIGHT, 1.0))


def _dipoles(points: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Centres and area vectors of at most about ``_MOST_DIPOLES`` groups of neighbouring triangles."""
    normals = 0.5 * face_normals(points, faces)
    centres = points[faces].mean(axis=1)
    if len(faces) <= _MOST_DIPOLES:
        return centres, normals
    areas = np.linalg.norm(normals, axis=1)
    cell = max(float(np.sqrt(2.0 * areas.sum() / _MOST_DIPOLES)), _ROUNDING)
    # Triangles that face apart must not cancel: the octant of the normal is part of the group's key.
    keys = np.column_stack([np.floor(centres / cell), normals > 0.0])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    return means_by_label(group, centres, areas), sums_by_label(group, normals)
