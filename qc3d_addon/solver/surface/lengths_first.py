# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Enclosed volumes give way where holding them would cost lengths.

A skin gains or loses volume by bending, which costs its lengths next to nothing. A box can do so only by stretching its
sides: one that is stretched along one axis, then along another, has more volume on its way than its keys have, and is
right so.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints

# How far the 99th percentile of a component's edges may leave the interval of their key lengths for its volume's sake:
# what nobody sees. Real pairs need up to 0.0015.
_MOST_EXCESS = 0.002
_PERCENTILE = 0.99
# Missing volume below this part never costs so much: where all must stretch, lengths change by a third of it.
SMALL_CORRECTION = 0.005
_SHORTEST = 1e-9  # cube units


class LengthsFirst:
    """Chooses between shapes with and without held volumes, component by component.

    Parameters
    ----------
    key0, key1 : (n, 3)
    edges : (e, 2) int64
    labels : (n,) int64
        Component of every vertex.
    """

    def __init__(self, key0: Floats, key1: Floats, edges: Ints, labels: Ints) -> None:
        ends = [_lengths(key, edges) for key in (key0, key1)]
        usable = np.minimum(*ends) > _SHORTEST
        self._edges = edges[usable]
        self._shortest, self._longest = np.minimum(*ends)[usable], np.maximum(*ends)[usable]
        self._labels = labels
        self._label = labels[self._edges[:, 0]]
        counts = np.bincount(self._label, minlength=int(labels.max(initial=-1)) + 1)
        # Where the percentile of each component is among its edges in order.
        self._has_edges = np.flatnonzero(counts)
        starts = np.cumsum(counts) - counts
        self._places = (starts + np.ceil(_PERCENTILE * (counts - 1)).astype(np.int64))[self._has_edges]

    def mixed(self, held: Floats, free: Floats) -> Floats:
        """(n, 3) between a shape without held volumes and one with them, as near to the latter as lengths allow."""
        added = self._excess(held) - self._excess(free)
        part = _MOST_EXCESS / np.maximum(added, _MOST_EXCESS)
        return np.asarray(free + part[self._labels][:, None] * (held - free))

    def _excess(self, shape: Floats) -> Floats:
        """(components,) how far edges leave the interval of their key lengths, the 99th percentile of each."""
        length = _lengths(shape, self._edges)
        excess = np.maximum(np.maximum(length / self._longest, 2.0 - length / self._shortest) - 1.0, 0.0)
        order = np.lexsort((excess, self._label))
        found = np.zeros(int(self._labels.max(initial=-1)) + 1)
        found[self._has_edges] = excess[order][self._places]
        return found


def _lengths(shape: Floats, edges: Ints) -> Floats:
    return np.asarray(np.linalg.norm(shape[edges[:, 1]] - shape[edges[:, 0]], axis=1))
