# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The embedding of both keys of a pair in the unit cube, and the way back for frames."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.rising import risen
from ..numerics.rotation_unwrapping import mean_turn
from ..numerics.rotations import rotation_matrices
from ..numerics.screws import best_turns, translation_factors
from ..triangles.deformation import TriangleDeformation
from ..triangles.geometry import areas, vertex_areas
from ..triangles.topology import face_adjacency, welded
from .keypair import KeyPair
from .own_axes import own_axes

STILL_TOLERANCE = 1e-6  # of the diagonal: above rounding in single precision, below what an animator would pose
# Of the size: what travels less is held the more strongly the less it travels, so that it makes no difference whether a
# vertex is just still or just not.
NEARLY_STILL = 1e-4
# Distance of the keys from the cube's faces: the volume around them needs room to move, and in-betweens may reach a
# little beyond both keys.
MARGIN = 0.17
# Size of a cube that several keys share, beside the size of their base: some keys reach beyond it.
ROOM = 1.25
# Where this part of the surface is still, it holds the whole.
_MOST_HELD = 0.04


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A rigid motion x -> R x + b, as the exponential of a twist: a screw motion.

    Parameters
    ----------
    turn : (3,)
        Rotation vector of the twist, radians.
    velocity : (3,)
        Linear part of the twist; it equals the translation b where ``turn`` is zero.
    """

    turn: Floats
    velocity: Floats

    @classmethod
    def identity(cls) -> RigidMotion:
        """The identity."""
        return cls(np.zeros(3), np.zeros(3))

    @classmethod
    def between(cls, source: Floats, target: Floats, weights: Floats) -> RigidMotion:
        """Best rigid motion of points ``source`` (n, 3) onto ``target`` (n, 3) by weighted least squares (Kabsch 1976).

        The weights (n,) are positive. Collinear points take the smallest rotation that fits.
        """
        weights = weights / weights.sum()
        source_center, target_center = weights @ source, weights @ target
        covariance = (target - target_center).T @ (weights[:, None] * (source - source_center))
        return cls._of_turn(best_turns(covariance[None])[0], source_center, target_center)

    @classmethod
    def of_surface(cls, source: Floats, target: Floats, faces: Ints, shares: Floats | None = None) -> RigidMotion:
        """Mean rigid motion of a surface from the shape ``source`` (n, 3) to the shape ``target`` (n, 3).

        The rotation is the area-weighted mean of the triangles' unwrapped rotations; the translation carries the
        centroid along. Without usable triangles, it is the least-squares fit of the positions. That fit would be wrong
        where wings flap or ends twist: there it can be half a turn away from the rotation of every triangle. What
        triangles count is multiplied by ``shares`` (m,).
        """
        share = np.ones(len(faces)) if shares is None else shares
        weights = vertex_areas(source, faces, share)
        vertices, group = welded(source, target)
        deformation = TriangleDeformation.between(source[vertices], target[vertices], group[faces])
        if not len(deformation.faces):
            return cls.between(source, target, weights)
        # Symmetric in both keys, and independent of their scale.
        sizes = np.sqrt(np.prod([areas(key[vertices], deformation.faces) for key in (source, target)], axis=0))
        turn = mean_turn(deformation.turns, face_adjacency(deformation.faces), sizes * share[deformation.rows])
        return cls._of_turn(turn, *(np.average(key, axis=0, weights=weights) for key in (source, target)))

    @classmethod
    def _of_turn(cls, turn: Floats, source_center: Floats, target_center: Floats) -> RigidMotion:
        shift = target_center - rotation_matrices(turn[None])[0] @ source_center
        return cls(turn, np.linalg.solve(translation_factors(turn[None])[0], shift))

    @property
    def rotation(self) -> Floats:
        """(3, 3) rotation matrix of the whole motion."""
        return np.asarray(rotation_matrices(self.turn[None])[0])

    def part(self, share: float) -> RigidMotion:
        """The motion up to ``share``, 0..1, of its way."""
        return RigidMotion(share * self.turn, share * self.velocity)

    def apply(self, points: Floats, time: float = 1.0) -> Floats:
        """Points (n, 3) moved along the screw up to ``time``: 0 is the start, 1 the whole motion."""
        turn = time * self.turn
        rotation = rotation_matrices(turn[None])[0]
        return np.asarray(points @ rotation.T + translation_factors(turn[None])[0] @ (time * self.velocity))

    def undo(self, points: Floats) -> Floats:
        """Points (n, 3) moved by the inverse of the whole motion."""
        return self.apply(points, -1.0)


@dataclass(frozen=True, eq=False)
class Cube:
    """Where the unit cube stands.

    Parameters
    ----------
    axes : (3, 3)
        Orthonormal rows: the axes of the cube in the keys' coordinates.
    center : (3,)
        The point that goes to the center of the cube, in coordinates along the axes.
    scale : float
        Cube units per unit of the keys.
    """

    axes: Floats
    center: Floats
    scale: float

    @classmethod
    def around(cls, pair: KeyPair) -> Cube:
        """The cube around the first key of a pair, whatever the second is, with room for most motions.

        All keys of one base lie in it with that base in one and the same place.
        """
        axes = own_axes(pair.key0, pair.key0, vertex_areas(pair.key0, *pair.covering))
        placed = pair.key0 @ axes.T
        low, high = placed.min(axis=0), placed.max(axis=0)
        size = ROOM * float((high - low).max())
        return cls(axes, 0.5 * (low + high), (1.0 - 2.0 * MARGIN) / (size if size > 0.0 else pair.diagonal))

    def holds(self, embedding: Embedding) -> bool:
        """Whether both keys of a pair that is embedded in this cube keep their distance from its faces."""
        return all(float(np.abs(key - 0.5).max()) <= 0.5 - MARGIN for key in (embedding.key0, embedding.key1))


@dataclass(frozen=True, eq=False)
class Embedding:
    """How a pair lies in the unit cube: one similarity for both keys, and the rigid motion removed from the second.

    The cube stands along axes that the keys define themselves: keys that are moved, turned and scaled alike come to lie
    in it in the same way.

    Parameters
    ----------
    pair : KeyPair
    axes : (3, 3)
        Orthonormal rows: the axes of the cube in the keys' coordinates.
    travel : (n,)
        Distances between the two positions of each vertex, relative to the diagonal of the first key along the axes.
    motion : RigidMotion
        Mean rigid motion of the surface from the first key to the second, in the keys' own units, in coordinates along
        the axes; only a part of it, or nothing, where some of the surface is still.
    center : (3,)
        The point that goes to the center of the cube, in coordinates along the axes.
    scale : float
        Cube units per unit of the keys.
    """

    pair: KeyPair
    axes: Floats
    travel: Floats
    motion: RigidMotion
    center: Floats
    scale: float

    @classmethod
    def of(cls, pair: KeyPair, cube: Cube | None = None) -> Embedding:
        """Embed a pair so that both keys, the second without its rigid motion, just fit into [0.17, 0.83]³.

        If a ``cube`` is given, embed the pair in that one instead; ``Cube.holds`` tells whether it fits.
        """
        faces, shares = pair.covering
        areas = vertex_areas(pair.key0, faces, shares)
        axes = own_axes(pair.key0, pair.key1, areas) if cube is None else cube.axes
        key0, key1 = pair.key0 @ axes.T, pair.key1 @ axes.T
        diagonal = float(np.linalg.norm(np.ptp(key0, axis=0))) or pair.diagonal
        travel = np.linalg.norm(key1 - key0, axis=1) / diagonal
        moves = _free_part(travel, areas)
        motion = RigidMotion.of_surface(key0, key1, faces, shares).part(moves) if moves else RigidMotion.identity()
        if cube is not None:
            return cls(pair, axes, travel, motion, cube.center, cube.scale)
        both = np.concatenate([key0, motion.undo(key1)])
        low, high = both.min(axis=0), both.max(axis=0)
        size = float((high - low).max())
        scale = (1.0 - 2.0 * MARGIN) / (size if size > 0.0 else pair.diagonal)
        return cls(pair, axes, travel, motion, 0.5 * (low + high), scale)

    @cached_property
    def still(self) -> Bools:
        """(n,) still vertices: those that both keys leave in place."""
        return np.asarray(self.travel <= STILL_TOLERANCE)

    def to_cube(self, points: Floats, time: float = 0.0) -> Floats:
        """Points (k, 3) in cube units, given in the keys' units at ``time`` (0..1) of the rigid motion."""
        moved = self.motion.apply(points @ self.axes.T, -time)
        return np.asarray((moved - self.center) * self.scale + 0.5)

    def from_cube(self, points: Floats, time: float) -> Floats:
        """Points (k, 3) in the keys' units, given in cube units, moved along the rigid motion up to ``time`` (0..1)."""
        return np.asarray(self.motion.apply((points - 0.5) / self.scale + self.center, time) @ self.axes)

    def straight(self, time: float) -> Floats:
        """(n, 3) cube positions at ``time`` that ``from_cube`` takes to the straight lines between the keys."""
        return self.to_cube(self.pair.key0 + time * (self.pair.key1 - self.pair.key0), time)

    def vectors_to_cube(self, vectors: Floats, time: float) -> Floats:
        """Displacements (k, 3) at ``time`` in cube units, given in the keys' units: ``from_cube`` inverted."""
        rotation = rotation_matrices(time * self.motion.turn[None])[0]
        return np.asarray(self.scale * (vectors @ self.axes.T @ rotation))

    @cached_property
    def key0(self) -> Floats:
        """(n, 3) the first key in cube units."""
        return self.to_cube(self.pair.key0)

    @cached_property
    def key1(self) -> Floats:
        """(n, 3) the second key in cube units, without its rigid motion."""
        return self.to_cube(self.pair.key1, 1.0)

    @cached_property
    def weights(self) -> Floats:
        """(n,) vertex areas of the first key, normalized to the sum 1; a loose vertex has a small positive weight."""
        areas = vertex_areas(self.key0, *self.pair.covering)
        return np.asarray(areas / areas.sum())


def _free_part(travel: Floats, areas: Floats) -> float:
    """How much of the whole's motion is to be taken out, 1 where nothing is still.

    It falls gradually with the part of the surface that is still or nearly so: one vertex more or less must not matter.

    Parameters
    ----------
    travel : (n,)
        Distances between the keys over the size.
    areas : (n,)
        Of the surface around the vertices.
    """
    held = float(areas @ (1.0 / (1.0 + (travel / NEARLY_STILL) ** 2))) / float(areas.sum())
    return 1.0 - float(risen(held, 0.0, _MOST_HELD))
