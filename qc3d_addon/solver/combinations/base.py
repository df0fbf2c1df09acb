# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A base and the keys that were made on it: checked, seams closed, in units in which the surface is solved."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Bools, Floats, Ints
from ..errors import InputError
from ..keys.embedding import STILL_TOLERANCE
from ..keys.keypair import KeyPair, require_sizes
from ..triangles.topology import sides, unique_edges, vertex_components


class KeysOnBase:
    """Two keys or more of one base.

    Parameters
    ----------
    base : (n, 3)
        The shape that all keys are relative to.
    keys : sequence of (n, 3)
        At least two.
    faces : (m, 3)
        Triangles.
    edges : (e, 2), optional
        Edges to keep together that belong to no triangle.

    Raises
    ------
    InputError
        If there are fewer than two keys, or a key cannot be used.

    Attributes
    ----------
    pairs : list of KeyPair
        The base with each key.
    vertices : (k,) int64
        One of each group of vertices that coincide in all keys; ``faces`` and ``edges`` count in these.
    group : (n,) int64
        The group of every vertex.
    still : (n,) bool
        Vertices that every key leaves in place.
    """

    def __init__(
        self, base: ArrayLike, keys: Sequence[ArrayLike], faces: ArrayLike, edges: ArrayLike | None = None
    ) -> None:
        if len(keys) < 2:
            raise InputError(f"A combination needs two keys or more, and {len(keys)} are given; choose another one.")
        self.pairs = [KeyPair.checked(base, key, faces, edges) for key in keys]
        for pair in self.pairs:
            require_sizes(pair)
        first = self.pairs[0]
        self.base, self.diagonal = first.key0, first.diagonal
        # What coincides in every pair; a vertex's group has the lowest number of those in it.
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
        """(k, 3) positions (n, 3) of the vertices that stand for all, the base's diagonal as unit."""
        return np.asarray((shape[self.vertices] - self._origin) * self._scale)

    def whole(self, positions: Floats, shapes: Sequence[Floats]) -> Floats:
        """(n, 3) positions of all vertices from ``scaled`` ones (k, 3).

        What every key leaves in place is there exactly. Copies of a vertex that rounding has moved apart are as far
        apart as the ``shapes`` (n, 3) have them together.
        """
        found = (positions * (1.0 / self._scale) + self._origin)[self.group]
        added = sum((shape - self.base for shape in shapes), start=self.base)
        if any(pair.nearly_coincident for pair in self.pairs):
            found += added - added[self.vertices][self.group]
        found[self.still] = added[self.still]
        return np.asarray(found)

    @cached_property
    def labels(self) -> Ints:
        """(k,) connected component of each of the ``vertices``."""
        return vertex_components(np.concatenate([unique_edges(sides(self.faces)), self.edges]), len(self.vertices))
