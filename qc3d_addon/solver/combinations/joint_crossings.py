# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossings that occur when several keys are on at once, but in none of them alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..collision.box_tree import CrowdedError
from ..collision.crossings import CrossingSearch


class JointCrossings:
    """Finds the new crossings of a surface in combinations of several shapes.

    Triangles that cross in the base or in one of the shapes may also cross in the combination, and so may their
    neighbors: where one shape folds the surface into itself, another one can shift the crossing by a triangle.

    Parameters
    ----------
    faces : (m, 3) int64
        Triangles.
    base : (n, 3)
        The base shape.
    shapes : sequence of (n, 3)
        The shapes that are combined.
    still : (n,) bool
        Vertices that have their place of the base in all shapes.
    """

    def __init__(self, faces: Ints, base: Floats, shapes: Sequence[Floats], still: Bools) -> None:
        self._faces = faces
        self._search = CrossingSearch(faces, (base, *shapes[:1]), ~still[faces].all(axis=1))
        self._in_base, *self._in_shapes = (self._codes(shape) for shape in (base, *shapes))

    def fresh(self, shape: Floats, on: Sequence[int] | None = None) -> Ints | None:
        """Pairs of triangles (k, 2) that cross in a combined shape, but in none of its parts.

        Parameters
        ----------
        shape : (n, 3)
            The combined shape.
        on : sequence of int, optional
            Indices of the shapes that it combines; all by default.

        Returns
        -------
        (k, 2) int64 or None
            None if so many triangles overlap, in it or in its parts, that the search was given up.
        """
        parts = self._in_shapes if on is None else [self._in_shapes[number] for number in on]
        in_parts = [part for part in (self._in_base, *parts) if part is not None]
        codes = self._codes(shape)
        if codes is None or len(in_parts) <= len(parts):
            return None
        known = np.concatenate(in_parts)
        beside = np.zeros(len(shape), dtype=bool)
        beside[self._faces[self._pairs(known)].ravel()] = True
        found = self._pairs(codes[~np.isin(codes, known)])
        near = beside[self._faces[found]].any(axis=2).all(axis=1)
        return np.asarray(found[~near])

    def _codes(self, shape: Floats) -> Ints | None:
        """One code for each crossing pair of triangles; None if the search was given up."""
        try:
            pairs = self._search.pairs(shape)
        except CrowdedError:
            return None
        return np.asarray(pairs[:, 0] * len(self._faces) + pairs[:, 1])

    def _pairs(self, codes: Ints) -> Ints:
        return np.stack([codes // len(self._faces), codes % len(self._faces)], axis=1)
