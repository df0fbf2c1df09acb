# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Symmetric frames of symmetric keys, whatever the triangulation and the samples of the volume."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from ..keys.keypair import KeyPair

# Of the diagonal: partners may be this far from the mirror image of a vertex.
_SYMMETRIC = 1e-5
# Of the diagonal: if a frame differs more from its mirror image, the motion itself is not symmetric, like that of
# something that turns over.
_ONE_SIDED = 0.05
# Vertices that are looked at first, and then: most planes are none of symmetry, which these few tell.
_FIRST_GLANCE, _FIRST_LOOK = 4, 60
# So many vertices are tried, each with so many partners.
_TRIED = 24


class _Plane(NamedTuple):
    normal: Floats
    point: Floats
    partners: Ints

    def image(self, shape: Floats) -> Floats:
        """(n, 3) the mirror image of a shape (n, 3): at each vertex, the image of its partner."""
        return _reflected(shape, self.normal, self.point)[self.partners]


class MirrorImages:
    """Averages shapes with their mirror images across the planes about which both keys are symmetric.

    Parameters
    ----------
    pair : KeyPair
    """

    def __init__(self, pair: KeyPair) -> None:
        self._vertices, self._group = pair.welding
        self._size = pair.diagonal
        self._keys = (pair.key0, pair.key1)
        keys = (pair.key0[self._vertices], pair.key1[self._vertices])
        both = np.concatenate(keys)
        point = both.mean(axis=0)
        reach = _SYMMETRIC * self._size
        tree = cKDTree(np.concatenate(keys, axis=1))
        self._planes: list[_Plane] = []
        for normal in _promising(_candidates([key - point for key in keys], reach), point, keys, tree, reach):
            if any(abs(normal @ plane.normal) > 1.0 - _SYMMETRIC for plane in self._planes):
                continue
            images = np.concatenate([_reflected(key, normal, point) for key in keys], axis=1)
            distances, found = tree.query(images, distance_upper_bound=reach)
            if np.isfinite(distances).all():
                partners: Ints = np.asarray(found, dtype=np.int64)
                if (partners[partners] == np.arange(len(partners))).all():
                    self._planes.append(_Plane(normal, point, partners))
        self._own = self._asymmetries()

    def __bool__(self) -> bool:
        return bool(self._planes)

    def keep(self, halfway: Floats) -> None:
        """Forget the planes about which the motion is not symmetric, by its shape (n, 3) halfway."""
        shape = halfway[self._vertices]
        self._planes = [
            plane
            for plane in self._planes
            if np.linalg.norm(plane.image(shape) - shape, axis=1).max(initial=0.0) <= _ONE_SIDED * self._size
        ]
        self._own = self._asymmetries()

    def averaged(self, shape: Floats, time: float) -> Floats:
        """A shape (n, 3) at ``time`` in the keys' coordinates, as symmetric as the keys: their own asymmetry stays."""
        if not self._planes:
            return shape
        first, second = self._own
        return self._symmetric(shape) + ((1.0 - time) * first + time * second)

    def _asymmetries(self) -> list[Floats]:
        """(n, 3) how far each key is from its symmetric form."""
        return [key - self._symmetric(key) for key in self._keys]

    def _symmetric(self, shape: Floats) -> Floats:
        for plane in self._planes:
            difference = plane.image(shape[self._vertices]) - shape[self._vertices]
            shape = shape + 0.5 * difference[self._group]
        return shape


def _candidates(keys: list[Floats], reach: float) -> Floats:
    """(k, 3) normals of planes through the origin that may mirror both keys (n, 3): those of some vertices."""
    far = [np.linalg.norm(key, axis=1) for key in keys]
    found = []
    for vertex in np.unique(np.linspace(0, len(keys[0]) - 1, _TRIED, dtype=np.int64)).tolist():
        alike = np.logical_and.reduce([np.abs(distance - distance[vertex]) <= reach for distance in far])
        between = keys[0][alike] - keys[0][vertex]
        length = np.linalg.norm(between, axis=1)
        apart = length > 1e2 * reach
        found.append((between[apart] / length[apart, None])[:_TRIED])
    return np.concatenate(found)


def _promising(normals: Floats, point: Floats, keys: tuple[Floats, Floats], tree: cKDTree, reach: float) -> Floats:
    """(c, 3) those of the normals (k, 3) whose planes mirror a few vertices of both keys, which ``tree`` has."""
    some = np.unique(np.linspace(0, len(keys[0]) - 1, _FIRST_LOOK, dtype=np.int64))
    for few in (some[:: max(1, len(some) // _FIRST_GLANCE)], some):
        away = [(key[few] - point) @ normals.T for key in keys]
        images = [key[few] - 2.0 * far.T[..., None] * normals[:, None] for key, far in zip(keys, away, strict=True)]
        # Nearest neighbors of what has no partner would be far away, and finding them takes long.
        distances, _ = tree.query(np.concatenate(images, axis=2), distance_upper_bound=reach)
        normals = normals[np.isfinite(distances).all(axis=1)]
    return normals


def _reflected(points: Floats, normal: Floats, point: Floats) -> Floats:
    return np.asarray(points - 2.0 * np.outer((points - point) @ normal, normal))
