# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes several meshes of one character, such as skin, lashes and clothes, in one map, so that they stay together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..arrays import Floats
from ..errors import InputError
from ..keys.halves import held_on_planes
from ..keys.keypair import Ends, KeyPair
from ..settings import FrameOptions
from .bake import Bake
from .key_times import KeyTimes
from .measures import worst_stretch


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """A mesh with its keys and its transform.

    Parameters
    ----------
    pairs : dict
        The pairs of the mesh, by the names of their keys, which are the same for all meshes.
    matrix : (4, 4)
        Transform from the mesh's own coordinates to those that all meshes share.
    """

    pairs: dict[Ends, KeyPair]
    matrix: Floats

    def shared(self, points: Floats) -> Floats:
        """Points (n, 3) of the mesh in the shared coordinates."""
        return np.asarray(points @ self.matrix[:3, :3].T + self.matrix[:3, 3])

    def own(self, points: Floats) -> Floats:
        """Points (..., 3) in shared coordinates, transformed to the mesh's own."""
        return np.asarray((points - self.matrix[:3, 3]) @ np.linalg.inv(self.matrix[:3, :3]).T)


class Together:
    """Joins the pairs of several meshes and separates their frames again.

    Parameters
    ----------
    meshes : sequence of PlacedMesh

    Raises
    ------
    InputError
        If there is no mesh, the names of the keys differ, or a transform is singular.

    Attributes
    ----------
    pairs : dict
        The joined pairs. Vertices that coincide in all keys, such as those of a lash on its lid, count as one.
    """

    def __init__(self, meshes: Sequence[PlacedMesh]) -> None:
        if not meshes:
            raise InputError("There are no meshes to bake together; give at least one.")
        for mesh in meshes:
            if mesh.pairs.keys() != meshes[0].pairs.keys():
                raise InputError("The meshes have keys of different names; meshes that are baked together share them.")
            if not abs(np.linalg.det(mesh.matrix[:3, :3])) > 0.0:
                raise InputError("A mesh has the scale 0 along an axis; set another scale.")
        self._meshes = meshes
        counts = [len(_any_pair(mesh).key0) for mesh in meshes]
        self._starts = np.cumsum([0, *counts]).tolist()
        self.pairs = {ends: self._joined(ends) for ends in meshes[0].pairs}

    def _joined(self, ends: Ends) -> KeyPair:
        pairs = [mesh.pairs[ends] for mesh in self._meshes]
        placed = list(zip(self._meshes, pairs, strict=True))
        key0 = np.concatenate([mesh.shared(pair.key0) for mesh, pair in placed])
        key1 = np.concatenate([mesh.shared(pair.key1) for mesh, pair in placed])
        starts = self._starts[:-1]
        flipped = [np.linalg.det(mesh.matrix[:3, :3]) < 0.0 for mesh in self._meshes]
        faces = [
            (pair.faces[:, ::-1] if turns else pair.faces) + start
            for pair, start, turns in zip(pairs, starts, flipped, strict=True)
        ]
        edges = [pair.edges + start for pair, start in zip(pairs, starts, strict=True)]
        polygons = [np.unique(pair.polygons, return_inverse=True)[1].ravel() for pair in pairs]
        first = np.cumsum([0, *(len(pair.faces) for pair in pairs)]).tolist()
        labels = [part + start for part, start in zip(polygons, first[:-1], strict=True)]
        return KeyPair(key0, key1, np.concatenate(faces), np.concatenate(edges), np.concatenate(labels))

    def apart(self, bake: Bake, options: FrameOptions, through: Sequence[str]) -> list[Bake]:
        """The bake of each mesh, in its own coordinates, from the bake of the joined pairs.

        Parameters
        ----------
        bake : Bake
        options : FrameOptions
            The options of the bake.
        through : sequence of str
            Names of the keys from the first to the last.
        """
        segments, local = KeyTimes.of(options, len(through) - 1).split(bake.times)
        found = []
        for mesh, start, end in zip(self._meshes, self._starts[:-1], self._starts[1:], strict=True):
            along = [mesh.pairs[ends] for ends in pairwise(through)]
            frames = mesh.own(bake.frames[:, start:end])
            for frame, number, time in zip(frames, segments.tolist(), local.tolist(), strict=True):
                _exact(frame, along[number], time)
            count = len(along[0].own.key0)
            frames = frames[:, :count]
            own = [pair.own for pair in along]
            report = replace(
                bake.report,
                vertices=count,
                welded=[len(pair.key0) - len(pair.welding[0]) for pair in own],
                worst_stretch=worst_stretch(own, segments, frames),
            )
            measures = {name: values[:, start : start + count] for name, values in bake.measures.items()}
            found.append(replace(bake, frames=frames, report=report, measures=measures))
        return found


def _any_pair(mesh: PlacedMesh) -> KeyPair:
    return next(iter(mesh.pairs.values()))


def _exact(frame: Floats, pair: KeyPair, time: float) -> None:
    """Make exact again what the transform has rounded: keys, still vertices, and vertices on a mirror plane."""
    if time in (0.0, 1.0):
        frame[...] = pair.key1 if time else pair.key0
        return
    stays = (pair.key0 == pair.key1).all(axis=1)
    frame[stays] = pair.key0[stays]
    frame[...] = held_on_planes(frame, time, pair.key0, pair.key1, pair.planes)
