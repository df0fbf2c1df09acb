# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The keys of one base shape: validated, with closed seams, in the units in which the surface is solved."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Bools, Floats, Ints
from ..errors import InputError
from ..keys.checks import require_sizes
from ..keys.embedding import STILL_TOLERANCE
from ..keys.keypair import KeyPair
from ..triangles.topology import sides, unique_edges, vertex_components


class KeysOnBase:
    """Two or more keys of one base shape.

    Parameters
    ----------
    base : (n, 3)
        The shape that all keys are relative to.
    keys : sequence of (n, 3)
        At least two keys.
    faces : (m, 3) int64
        Triangles.
    edges : (e, 2) int64, optional
        Edges that belong to no triangle and keep their length.

    Raises
    ------
    InputError
        If there are fewer than two keys, or a key cannot be used.

    Attributes
    ----------
    pairs : list of KeyPair
        The base with each key.
    vertices : (k,) int64
        One vertex of each group that coincides in all keys; ``faces`` and ``edges`` use indices into these.
    group : (n,) int64
        The group of every vertex.
    still : (n,) bool
        Whether all keys leave a vertex in place.
    """

    def __init__(
        self, base: ArrayLike, keys: Sequence[ArrayLike], faces: ArrayLike, edges: ArrayLike | None = None
    ) -> None:
        if len(keys) < 2:
            raise InputError(f"A combination needs two keys or more, and {len(keys)} are given; choose another one.")
        self.pairs = [KeyPair.checked(base, key, faces, edges) for key in keys]
        for pair in self.pairs:
            require_sizes(pair.key0, pair.key1)
        first = self.pairs[0]
        self.base, self.diagonal = first.key0, first.diagonal
        # Vertices are grouped if they coincide in every pair.
        groups = np.stack([pair.welding[1] for pair in self.pairs], axis=1)
        _, vertices, group = np.unique(groups, axis=0, return_index=True, return_inverse=True)
        order = np.argsort(vertices)
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order))
        self.vertices: Ints = vertices[order].astype(np.int64)
        self.group: Ints = rank[group.ravel()]
        self.faces: Ints = self.group[first.faces]
        self.edges: Ints = self.group[first.edges]
        reach = STILL_TOLERANCE * self.diagonal
        moved = [np.linalg.norm(pair.key1 - pair.key0, axis=1) > reach for pair in self.pairs]
        self.still: Bools = ~np.logical_or.reduce(moved)
        self._scale = 1.0 / self.diagonal
        self._origin = 0.5 * (self.base.min(axis=0) + self.base.max(axis=0))

    def scaled(self, shape: Floats) -> Floats:
        """(k, 3) positions of the representative ``vertices`` of a shape (n, 3), in units of the base's diagonal."""
        return np.asarray((shape[self.vertices] - self._origin) * self._scale)

    def whole(self, positions: Floats, shapes: Sequence[Floats]) -> Floats:
        """(n, 3) positions of all vertices, given ``scaled`` ones (k, 3): the inverse of ``scaled``.

        Still vertices are placed exactly. Coincident vertices that rounding has separated keep the offsets that the sum
        of the ``shapes`` (n, 3) gives them.
        """
        found = (positions * (1.0 / self._scale) + self._origin)[self.group]
        added = sum((shape - self.base for shape in shapes), start=self.base)
        if any(pair.nearly_coincident for pair in self.pairs):
            found += added - added[self.vertices][self.group]
        found[self.still] = added[self.still]
        return np.asarray(found)

    @cached_property
    def labels(self) -> Ints:
        """(k,) connected component of each of the representative ``vertices``."""
        return vertex_components(np.concatenate([unique_edges(sides(self.faces)), self.edges]), len(self.vertices))
