# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An as-rigid-as-possible morph on the surface, by libigl as it is published.

Libigl deforms one shape by handles (``igl.arap_precomputation``, ``igl.arap_solve``; Sorkine & Alexa 2007, with spokes
and rims). A morph of two keys is made of it as an animator would:

1. Align the second key to the first by the best rigid motion.
2. Handles are 3 % of the vertices, spread over the first key by farthest points, and at least three of each connected
   part; they move along straight lines. The rest of the first key follows them as rigidly as possible, and so does the
   rest of the second key.
3. The two shapes are blended with the weights 1 - t and t, so that both keys are met.
4. Put back the fraction t of the rigid motion.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .gradients import Floats, Ints, RigidMotion

HANDLES, FEWEST = 0.03, 3


def frames(key0: Floats, key1: Floats, faces: Ints, times: ArrayLike) -> Floats:
    """In-betweens (k, n, 3) at the times; needs the package ``libigl``."""
    motion = RigidMotion.between(key0, key1)
    target = motion.undo(key1)
    handles = handles_of(key0, faces)
    deformed = [_Deformer(key, faces, handles) for key in (key0, target)]
    made = []
    for time in np.asarray(times, dtype=np.float64).tolist():
        straight = (1.0 - time) * key0 + time * target
        first, second = (one.shape(straight) for one in deformed)
        made.append(motion.apply((1.0 - time) * first + time * second, time))
    return np.stack(made)


def handles_of(points: Floats, faces: Ints) -> Ints:
    """Numbers of vertices: spread over all, and more in parts that have too few, where libigl finds no shape."""
    sides = (np.ones(2 * len(faces)), (faces[:, :2].T.ravel(), faces[:, 1:].T.ravel()))
    count, part = connected_components(coo_array(sides, shape=(len(points), len(points))), directed=False)
    handles = spread(points, max(FEWEST + 1, round(HANDLES * len(points))))
    few = np.flatnonzero(np.bincount(part[handles], minlength=count) < FEWEST)
    members = [np.flatnonzero(part == number) for number in few]
    more = [rows[spread(points[rows], min(FEWEST, len(rows)))] for rows in members]
    return np.asarray(np.unique(np.concatenate([handles, *more])), dtype=np.int64)


def spread(points: Floats, count: int) -> Ints:
    """``count`` points, each the farthest from those before; the first is the farthest from the middle."""
    chosen = [int(np.argmax(((points - points.mean(axis=0)) ** 2).sum(axis=1)))]
    distances = ((points - points[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(distances)))
        distances = np.minimum(distances, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return np.array(chosen)


class _Deformer:
    """One rest shape, and its handles."""

    def __init__(self, rest: Floats, faces: Ints, handles: Ints) -> None:
        self._igl: Any = importlib.import_module("igl")
        self._handles = handles
        self._data = self._igl.ARAPData()
        self._data.max_iter = 100
        self._igl.arap_precomputation(rest, faces, 3, handles.astype(np.int32), self._data)

    def shape(self, start: Floats) -> Floats:
        """Positions (n, 3) with the handles as in ``start``, from where the iterations begin."""
        places = np.ascontiguousarray(start[self._handles])
        return np.asarray(self._igl.arap_solve(places, self._data, np.ascontiguousarray(start)))
