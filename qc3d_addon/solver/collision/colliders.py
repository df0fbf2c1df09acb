# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colliders: surfaces that in-betweens must not enter, and the resolution of collisions with them."""

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

# Largest clearance of a vertex, in mean edges of the mesh, however far its keys are from the collider: enough that the
# flat triangles between vertices stay out as well.
_CLEARANCE = 0.25
_PUSHES = 4  # pushed out of one part of a collider, a vertex may enter another; more rounds are rarely needed


@dataclass(frozen=True, eq=False)
class Collider:
    """A surface that in-betweens must not enter, given at each key of a chain.

    Parameters
    ----------
    shapes : (k, c, 3)
        Positions of its vertices at each of the chain's keys, in the keys' own coordinates.
    faces : (f, 3) int64
        Triangles with normals pointing out.
    """

    shapes: Floats
    faces: Ints

    @classmethod
    def checked(cls, shapes: ArrayLike, faces: ArrayLike) -> Collider:
        """Validate arrays of any origin and make a collider of them.

        Raises
        ------
        InputError
            If shapes disagree, a coordinate is not finite, an index is out of range, or there are no triangles.
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
        """One collider made of several, all given at the same keys."""
        offsets = np.cumsum([0, *(part.shapes.shape[1] for part in parts[:-1])])
        faces = [part.faces + offset for part, offset in zip(parts, offsets, strict=True)]
        return cls(np.concatenate([part.shapes for part in parts], axis=1), np.concatenate(faces))

    def at_keys(self, count: int) -> Collider:
        """The collider for a chain of ``count`` keys; if it is given only once, it stays in place.

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
        """Whether its shape or place differs between keys."""
        return not bool((self.shapes == self.shapes[0]).all())



class PosedCollider:
    """A collider at the times of a chain's frames.

    Parameters
    ----------
    collider : Collider
    frames : (k, c, 3)
        Positions of its vertices in each frame, in the keys' own coordinates.
    """

    def __init__(self, collider: Collider, frames: Floats) -> None:
        self._collider, self._frames = collider, frames
        self._last: tuple[Floats, SurfaceDistance] | None = None

    def at_key(self, number: int) -> SurfaceDistance:
        """Distances from the collider at the chain's key with this index."""
        return self._distances(self._collider.shapes[number])

    def at(self, index: int) -> SurfaceDistance:
        """Distances from the collider in the frame with this index."""
        return self._distances(self._frames[index])

    def crossings(self, frames: Floats, faces: Ints) -> list[int | None]:
        """Number of crossing pairs of a triangle of the mesh and one of the collider, for each frame (k, n, 3).

        None for a frame in which so many triangles overlap that the search was given up.
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
            self._last = (shape, SurfaceDistance(shape, self._collider.faces))  # reused if the collider is fixed
        return self._last[1]


class CollisionResolver:
    """Resolves collisions of one pair's frames with a collider.

    Each vertex must keep the distance from the collider that is interpolated between its distances in the two keys,
    but never more than a small clearance. If a key itself lies inside the collider, its depth is interpolated the same
    way.

    Parameters
    ----------
    collider : PosedCollider
    pair : KeyPair
    number : int
        Index of the pair in the chain.
    members : (j,) int64
        Indices, among the posed collider's frames, of the frames that belong to the pair.
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

    @np.errstate(over="ignore", invalid="ignore")  # vertices whose distance is infinite are not near
    def pushed(self, index: int, positions: Floats, time: float) -> tuple[Bools, Floats]:
        """Move the vertices that are too close to the collider.

        Parameters
        ----------
        index : int
            Index of the frame among those of the pair.
        positions : (n, 3)
            Vertices of that frame, in the keys' own coordinates.
        time : float
            Time of the frame within the pair, 0..1.

        Returns
        -------
        near : (n,) bool
            Whether each vertex was too close.
        moved : (n, 3)
            Positions at the required distance for those, unchanged for the others.
        """
        wanted = np.minimum((1.0 - time) * self._kept[0] + time * self._kept[1], self._most)
        found, place, normal = self._collider.at(int(self._members[index])).nearest(positions)
        near = found < wanted - self._rounding
        return near, np.where(near[:, None], place + wanted[:, None] * normal, positions)

    def cleared(self, index: int, positions: Floats, time: float, still: Bools) -> Floats:
        """(n, 3) positions of a frame after all vertices but the ``still`` ones (n,) are pushed out individually."""
        for _ in range(_PUSHES):
            near, moved = self.pushed(index, positions, time)
            near &= ~still
            if not near.any():
                break
            positions = np.where(near[:, None], moved, positions)
        return positions
