# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colliders: surfaces that in-betweens must not touch, and how far from them every vertex has to stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Bools, Floats, Ints
from ..errors import InputError
from ..keys.keypair import KeyPair
from ..triangles.topology import sides
from .box_tree import CrowdedError
from .crossings import CrossingSearch
from .surface_distance import SurfaceDistance

# A vertex keeps at most this part of the mesh's mean edge from a collider, however far its keys are from it: enough for
# the flat triangles between vertices.
_CLEARANCE = 0.25
# Pushed out of one part of a collider, a vertex may be too near to another; seldom more often than this.
_PUSHES = 4


@dataclass(frozen=True, eq=False)
class Collider:
    """What must not be touched, at each key of a chain.

    Parameters
    ----------
    shapes : (k, c, 3)
        Positions at each of the chain's keys, in the keys' own coordinates.
    faces : (f, 3) int64
        Triangles, normals pointing out.
    """

    shapes: Floats
    faces: Ints

    @classmethod
    def checked(cls, shapes: ArrayLike, faces: ArrayLike) -> Collider:
        """A collider from arrays of unknown origin.

        Raises
        ------
        InputError
            If the arrays do not belong together or hold numbers that are none.
        """
        positions = np.asarray(shapes, dtype=np.float64)
        if positions.ndim != 3 or positions.shape[2] != 3:
            raise InputError("The positions of a collider must be given for every key: (k, c, 3).")
        if not np.isfinite(positions).all():
            raise InputError("A collider has coordinates that are not finite.")
        triangles = np.asarray(faces)
        if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles) or triangles.dtype.kind not in "iu":
            raise InputError("A collider has no triangles; choose meshes with faces.")
        if triangles.min() < 0 or triangles.max() >= positions.shape[1]:
            raise InputError("A triangle of a collider has a corner that is no vertex.")
        return cls(positions, triangles.astype(np.int64))

    @classmethod
    def joined(cls, parts: Sequence[Collider]) -> Collider:
        """One collider of several, all given at the same keys."""
        offsets = np.cumsum([0, *(part.shapes.shape[1] for part in parts[:-1])])
        faces = [part.faces + offset for part, offset in zip(parts, offsets, strict=True)]
        return cls(np.concatenate([part.shapes for part in parts], axis=1), np.concatenate(faces))

    def at_keys(self, count: int) -> Collider:
        """The collider for a chain of so many keys: one that is given once stays where it is.

        Raises
        ------
        InputError
            If it is given at another number of keys.
        """
        if len(self.shapes) == 1:
            return Collider(np.repeat(self.shapes, count, axis=0), self.faces)
        if len(self.shapes) != count:
            raise InputError(f"A collider is given at {len(self.shapes)} keys; give it once, or at all {count} keys.")
        return self

    @property
    def moves(self) -> bool:
        """Whether it is not the same at every key."""
        return not bool((self.shapes == self.shapes[0]).all())



class PosedCollider:
    """A collider at the times of some frames of a chain.

    Parameters
    ----------
    collider : Collider
    frames : (k, c, 3)
        Where it is at each time, in the keys' own coordinates.
    """

    def __init__(self, collider: Collider, frames: Floats) -> None:
        self._collider, self._frames = collider, frames
        self._last: tuple[Floats, SurfaceDistance] | None = None

    def at_key(self, number: int) -> SurfaceDistance:
        """Distances from the collider at a key of the chain."""
        return self._distances(self._collider.shapes[number])

    def at(self, index: int) -> SurfaceDistance:
        """Distances from the collider in a frame."""
        return self._distances(self._frames[index])

    def crossings(self, frames: Floats, faces: Ints) -> list[int | None]:
        """For each frame (k, n, 3) the pairs of triangles, one of the mesh and one of the collider, that cross.

        None where so many lie over each other that the search is given up.
        """
        if not len(frames):
            return []
        together = np.concatenate([faces, self._collider.faces + frames.shape[1]])
        is_mesh = np.arange(len(together)) < len(faces)
        shapes = [np.concatenate(both) for both in zip(frames, self._frames, strict=True)]
        search = CrossingSearch(together, (shapes[0], shapes[-1]), sides=is_mesh)
        counts: list[int | None] = []
        for shape in shapes:
            try:
                counts.append(len(search.pairs(shape)))
            except CrowdedError:
                counts.append(None)
        return counts

    def _distances(self, shape: Floats) -> SurfaceDistance:
        if self._last is None or not np.array_equal(self._last[0], shape):
            self._last = (shape, SurfaceDistance(shape, self._collider.faces))  # fixed colliders need no more than one
        return self._last[1]


class CollisionResolver:
    """Resolves collisions of the frames of one pair of keys with a collider.

    A vertex keeps the distance that its keys keep from the collider, interpolated, but never more than the flat
    triangles between vertices need. One that a key itself has inside is let in as far as that.

    Parameters
    ----------
    collider : PosedCollider
    pair : KeyPair
    number : int
        Number of the pair in the chain.
    members : (j,)
        Which of the posed collider's frames the pair has.
    """

    def __init__(self, collider: PosedCollider, pair: KeyPair, number: int, members: Ints) -> None:
        self._collider, self._members = collider, members
        self._kept = [
            collider.at_key(number + end).nearest(key)[0] for end, key in enumerate((pair.key0, pair.key1))
        ]
        edges = sides(pair.faces)
        lengths = np.linalg.norm(pair.key0[edges[:, 0]] - pair.key0[edges[:, 1]], axis=1)
        self._most = _CLEARANCE * float(lengths.mean()) if len(lengths) else 0.0
        self._rounding = 1e-9 * pair.diagonal

    def pushed(self, index: int, positions: Floats, time: float) -> tuple[Bools, Floats]:
        """Which vertices (n, 3) of the pair's frame ``index`` are too near, and positions where they are not."""
        wanted = np.minimum((1.0 - time) * self._kept[0] + time * self._kept[1], self._most)
        found, place, normal = self._collider.at(int(self._members[index])).nearest(positions)
        near = found < wanted - self._rounding
        return near, np.where(near[:, None], place + wanted[:, None] * normal, positions)

    def cleared(self, index: int, positions: Floats, time: float, still: Bools) -> Floats:
        """Positions (n, 3) of a frame with every vertex but the ``still`` ones (n,) pushed out, each by itself."""
        for _ in range(_PUSHES):
            near, moved = self.pushed(index, positions, time)
            near &= ~still
            if not near.any():
                break
            positions = np.where(near[:, None], moved, positions)
        return positions
