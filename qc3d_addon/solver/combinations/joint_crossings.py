# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What crosses where several keys are on at once, and in none of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..collision.box_tree import CrowdedError
from ..collision.crossings import CrossingSearch


class JointCrossings:
    """Crossings of a surface that some of several shapes make together.

    What crosses in the base or in one of the shapes may cross in all together, and so may what touches it: where a
    shape has folded the surface into itself, the crossing moves on by a triangle as another shape turns it.

    Parameters
    ----------
    faces : (m, 3) int64
    base : (n, 3)
    shapes : sequence of (n, 3)
        Of which some are on at once.
    still : (n,) bool
        Vertices that are where the base has them in all shapes.
    """

    def __init__(self, faces: Ints, base: Floats, shapes: Sequence[Floats], still: Bools) -> None:
        self._faces = faces
        self._search = CrossingSearch(faces, (base, *shapes[:1]), ~still[faces].all(axis=1))
        self._in_base, *self._in_shapes = (self._codes(shape) for shape in (base, *shapes))

    def fresh(self, shape: Floats, on: Sequence[int] | None = None) -> Ints | None:
        """Pairs of triangles (k, 2) that cross in a shape (n, 3) and in none of those it is made of.

        None where so many triangles lie over each other, in it or in those, that the search is given up.

        Parameters
        ----------
        shape : (n, 3)
        on : sequence of int, optional
            Numbers of the shapes that are on; all where it is not given.
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
        """One number for each pair of triangles that cross; None where the search is given up."""
        try:
            pairs = self._search.pairs(shape)
        except CrowdedError:
            return None
        return np.asarray(pairs[:, 0] * len(self._faces) + pairs[:, 1])

    def _pairs(self, codes: Ints) -> Ints:
        return np.stack([codes // len(self._faces), codes % len(self._faces)], axis=1)
