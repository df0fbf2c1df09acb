# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where loose parts go: each along a screw that turns like the surface around it.

Rotations and lengths tell nothing about the place of a part that no edge connects to another. The map of the volume
does, but its tetrahedra are others for every key. A screw whose rotation is a smooth mean over the surface nearby
changes as little as the keys do: pieces of an arm follow its arc, scattered leaves, each turning its own way, fall
straight.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints
from ..numerics.grouped_sums import means_by_label, sums_by_label
from ..numerics.rotation_unwrapping import Turning
from ..numerics.rotations import rotation_matrices
from ..numerics.screws import translation_factors

# Of a component, about the root of the number of its triangles is looked at: many of a skin, few of each stone. So many
# of the nearest count; what a triangle counts falls to zero at the last of them, so that none comes or goes at once.
_NEAREST = 64
# What a part's own turn counts beside that of others, if those count at least about the second factor as much as it: it
# may turn like a thrown ball, which does not bend its way.
_OWN_SHARE, _SOME = 1.0 / 3.0, 0.1
# A part whose screw axis is further away than so many times the surface nearby reaches goes straight: how a small piece
# turns tells nothing about a way that is far longer than it.
_FARTHEST_AXIS = 10.0


class PartPlaces:
    """The paths of the centers of a surface's components.

    Components with still vertices, or without a usable triangle, have no such path.

    Parameters
    ----------
    key0, key1 : (n, 3)
    still : (n,) bool
    weights : (n,)
        Positive weights of the vertices.
    labels : (n,) int64
        Component of every vertex.
    triangles : (m, 3) int64
        The usable triangles.
    areas : (m,)
        What they count.
    turning : Turning
        How they turn from the first key to the second.
    """

    def __init__(
        self,
        key0: Floats,
        key1: Floats,
        still: Bools,
        weights: Floats,
        labels: Ints,
        triangles: Ints,
        areas: Floats,
        turning: Turning,
    ) -> None:
        count = int(labels.max(initial=-1)) + 1
        owners = labels[triangles[:, 0]] if len(triangles) else np.empty(0, dtype=np.int64)
        told = np.bincount(owners, minlength=count) > 0
        told[labels[still]] = False
        self._members = np.flatnonzero(told[labels])
        if not len(self._members):
            return
        own = labels[self._members]
        self._parts: Ints = np.unique(own, return_inverse=True)[1].ravel().astype(np.int64)
        weight = weights[self._members]
        self._weights = weight / sums_by_label(self._parts, weight)[self._parts]
        centers = [self._means(key) for key in (key0, key1)]
        vectors = turning.swing + turning.twist
        travel = np.linalg.norm(centers[1] - centers[0], axis=1)
        middles = key0[triangles].mean(axis=1)
        self._turns = _around(np.unique(own), centers[0], travel, middles, owners, areas, vectors)
        rotations = rotation_matrices(self._turns)
        shift = centers[1] - np.einsum("kij,kj->ki", rotations, centers[0])
        self._velocities = np.linalg.solve(translation_factors(self._turns), shift[:, :, None])[:, :, 0]
        self._centers = centers[0]

    def moved(self, points: Floats, time: float) -> Floats:
        """Points (n, 3) of the surface at ``time``, 0..1, each component shifted to where its center is then."""
        if not len(self._members):
            return points
        turns = time * self._turns
        wanted = np.einsum("kij,kj->ki", rotation_matrices(turns), self._centers)
        wanted += np.einsum("kij,kj->ki", translation_factors(turns), time * self._velocities)
        moved = points.copy()
        moved[self._members] += (wanted - self._means(points))[self._parts]
        return moved

    def _means(self, points: Floats) -> Floats:
        return means_by_label(self._parts, points[self._members], self._weights)


def _around(
    parts: Ints, places: Floats, travel: Floats, centers: Floats, owners: Ints, areas: Floats, vectors: Floats
) -> Floats:
    """(k, 3) mean turn of the triangles around each part's place (k, 3), as far as it tells about a way of length (k,).

    The triangles (m,) have centers, components, areas and rotation vectors; the nearer ones count most.
    """
    chosen = _some_of_each(owners)
    # What the triangles that are left out count goes to those that are looked at.
    looked_at = sums_by_label(owners[chosen], areas[chosen], int(owners.max()) + 1)
    counted = areas[chosen] * (sums_by_label(owners, areas) / np.maximum(looked_at, 1e-300))[owners[chosen]]
    distances, nearest = cKDTree(centers[chosen]).query(places, k=min(_NEAREST, -(-len(chosen) // 2)))
    distances, nearest = (np.asarray(found).reshape(len(places), -1) for found in (distances, nearest))
    shares = counted[nearest] * np.maximum(1.0 - (distances / np.maximum(distances[:, -1:], 1e-300)) ** 2, 1e-12) ** 2
    own = owners[chosen][nearest] == parts[:, None]
    sums = [np.maximum((shares * counts).sum(axis=1), 1e-300) for counts in (own, ~own)]
    own_share = _OWN_SHARE + (1.0 - _OWN_SHARE) * np.exp(-np.minimum(sums[1] / (_SOME * sums[0]), 1e2))
    shares = shares * np.where(own, (own_share / sums[0])[:, None], ((1.0 - own_share) / sums[1])[:, None])
    shares = shares / shares.sum(axis=1, keepdims=True)
    beside = vectors[chosen][nearest]
    turns = np.einsum("kn,kni->ki", shares, beside)
    # What turns in all directions tells nothing, nor what is left of it on average.
    turned = (shares * np.linalg.norm(beside, axis=2)).sum(axis=1)
    turns = turns * (np.linalg.norm(turns, axis=1) / np.maximum(turned, 1e-300))[:, None] ** 2
    reach = np.sqrt((shares * distances**2).sum(axis=1))
    # The axis is about as far away as the way is long, over the angle.
    near = (_FARTHEST_AXIS * np.linalg.norm(turns, axis=1) * reach) ** 4
    return np.asarray(turns * (near / np.maximum(near + travel**4, 1e-300))[:, None])


def _some_of_each(owners: Ints) -> Ints:
    """Some triangles of each component (m,), evenly by number."""
    order = np.argsort(owners, kind="stable")
    sizes = np.bincount(owners)
    place = np.arange(len(owners)) - (np.cumsum(sizes) - sizes)[owners[order]]
    step = np.maximum(np.floor(np.sqrt(sizes)), 1.0).astype(np.int64)
    return np.asarray(np.sort(order[place % step[owners[order]] == 0]))
