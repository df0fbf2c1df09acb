# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Both keys of a pair brought into the unit cube, and frames brought back."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..numerics.rotation_unwrapping import mean_turn
from ..numerics.rotations import rotation_matrices
from ..numerics.screws import best_turns, translation_factors
from ..triangles.deformation import TriangleDeformation
from ..triangles.geometry import areas, vertex_areas
from ..triangles.topology import face_adjacency, welded
from .keypair import KeyPair
from .own_axes import own_axes

STILL_TOLERANCE = 1e-6
# Of the size: what travels less is held the more strongly the less it travels, so that it makes no difference whether a
# vertex is just still or just not.
NEARLY_STILL = 1e-4
MARGIN = 0.17
# Where this part of the surface is still, it holds the whole.
_MOST_HELD = 0.04


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """The screw motion x -> R x + b as the exponential of a twist (rotation vector, velocity).

    Parameters
    ----------
    turn : (3,)
        Rotation vector, radians.
    velocity : (3,)
        Linear part of the twist; the pure translation where nothing turns.
    """

    turn: Floats
    velocity: Floats

    @classmethod
    def identity(cls) -> RigidMotion:
        """The motion that leaves everything in place."""
        return cls(np.zeros(3), np.zeros(3))

    @classmethod
    def between(cls, source: Floats, target: Floats, weights: Floats) -> RigidMotion:
        """Best rigid motion of the points ``source`` (n, 3) onto ``target`` in the weighted least-squares sense.

        Weights (n,) are positive. Kabsch (1976). Points in one line turn no further than their line does.
        """
        weights = weights / weights.sum()
        source_centre, target_centre = weights @ source, weights @ target
        covariance = (target - target_centre).T @ (weights[:, None] * (source - source_centre))
        return cls._of_turn(best_turns(covariance[None])[0], source_centre, target_centre)

    @classmethod
    def of_surface(cls, source: Floats, target: Floats, faces: Ints) -> RigidMotion:
        """The mean motion of a surface from the shape ``source`` (n, 3) to ``target``.

        It turns by the mean of the triangles' unwrapped rotations, weighted by area, and carries the centre of the
        surface along. The best fit of the positions, which is all there is without triangles, is another thing where
        wings flap or ends twist: there it can be half a turn away from every one of them.
        """
        weights = vertex_areas(source, faces)
        vertices, group = welded(source, target)
        deformation = TriangleDeformation.between(source[vertices], target[vertices], group[faces])
        if not len(deformation.faces):
            return cls.between(source, target, weights)
        # The same for both directions, and however much a key is scaled.
        sizes = np.sqrt(np.prod([areas(key[vertices], deformation.faces) for key in (source, target)], axis=0))
        turn = mean_turn(deformation.turns, face_adjacency(deformation.faces), sizes)
        return cls._of_turn(turn, *(np.average(key, axis=0, weights=weights) for key in (source, target)))

    @classmethod
    def _of_turn(cls, turn: Floats, source_centre: Floats, target_centre: Floats) -> RigidMotion:
        shift = target_centre - rotation_matrices(turn[None])[0] @ source_centre
        return cls(turn, np.linalg.solve(translation_factors(turn[None])[0], shift))

    @property
    def rotation(self) -> Floats:
        """(3, 3) the rotation of the whole motion."""
        return np.asarray(rotation_matrices(self.turn[None])[0])

    def part(self, share: float) -> RigidMotion:
        """The motion up to ``share``, 0..1, of its way."""
        return RigidMotion(share * self.turn, share * self.velocity)

    def apply(self, points: Floats, time: float = 1.0) -> Floats:
        """Move points (n, 3) along the screw up to ``time`` (0 = not at all, 1 = all the way)."""
        turn = time * self.turn
        rotation = rotation_matrices(turn[None])[0]
        return np.asarray(points @ rotation.T + translation_factors(turn[None])[0] @ (time * self.velocity))

    def undo(self, points: Floats) -> Floats:
        """Move points (n, 3) back along the whole screw."""
        return self.apply(points, -1.0)


@dataclass(frozen=True, eq=False)
class Embedding:
    """One similarity of both keys into the cube, and the rigid motion that was taken out of the second key.

    The cube stands along axes that the keys define themselves: keys that are moved, turned and scaled alike come to lie
    in it in the same way.

    Parameters
    ----------
    pair : KeyPair
    axes : (3, 3)
        Orthonormal rows: the axes of the cube in the keys' coordinates.
    travel : (n,)
        Distances between the two positions of each vertex over the diagonal of the first key's box along the axes.
    motion : RigidMotion
        Carries the first key along with the second as their surface does on average, in the keys' own units, seen
        along the axes. The less of it, the more of the surface is still.
    centre : (3,)
        Point that goes to the middle of the cube, seen along the axes.
    scale : float
        Cube units per unit of the keys.
    """

    pair: KeyPair
    axes: Floats
    travel: Floats
    motion: RigidMotion
    centre: Floats
    scale: float

    @classmethod
    def of(cls, pair: KeyPair) -> Embedding:
        """Embed a pair: both keys, the second one without its rigid motion, fill [0.17, 0.83]^3."""
        axes = own_axes(pair.key0, pair.key1, vertex_areas(pair.key0, pair.faces))
        key0, key1 = pair.key0 @ axes.T, pair.key1 @ axes.T
        diagonal = float(np.linalg.norm(np.ptp(key0, axis=0))) or pair.diagonal
        travel = np.linalg.norm(key1 - key0, axis=1) / diagonal
        moves = _free_part(travel, vertex_areas(key0, pair.faces))
        motion = RigidMotion.of_surface(key0, key1, pair.faces).part(moves) if moves else RigidMotion.identity()
        both = np.concatenate([key0, motion.undo(key1)])
        low, high = both.min(axis=0), both.max(axis=0)
        size = float((high - low).max())
        scale = (1.0 - 2.0 * MARGIN) / (size if size > 0.0 else pair.diagonal)
        return cls(pair, axes, travel, motion, 0.5 * (low + high), scale)

    @cached_property
    def still(self) -> Bools:
        """(n,): vertices that both keys leave in place."""
        return np.asarray(self.travel <= STILL_TOLERANCE)

    def to_cube(self, points: Floats, time: float = 0.0) -> Floats:
        """Points (k, 3) from the keys' units to cube units, moved back along the rigid motion from ``time``."""
        moved = self.motion.apply(points @ self.axes.T, -time)
        return np.asarray((moved - self.centre) * self.scale + 0.5)

    def from_cube(self, points: Floats, time: float) -> Floats:
        """Points (k, 3) from cube units back to the keys' units, moved along the rigid motion up to ``time``."""
        return np.asarray(self.motion.apply((points - 0.5) / self.scale + self.centre, time) @ self.axes)

    def straight(self, time: float) -> Floats:
        """(n, 3) cube positions at ``time`` that ``from_cube`` takes to the straight lines between the keys."""
        return self.to_cube(self.pair.key0 + time * (self.pair.key1 - self.pair.key0), time)

    def vectors_to_cube(self, vectors: Floats, time: float) -> Floats:
        """Displacements (k, 3) at ``time`` from the keys' units to cube units: ``from_cube`` undone for differences."""
        rotation = rotation_matrices(time * self.motion.turn[None])[0]
        return np.asarray(self.scale * (vectors @ self.axes.T @ rotation))

    @cached_property
    def key0(self) -> Floats:
        """(n, 3): the first key in cube units."""
        return self.to_cube(self.pair.key0)

    @cached_property
    def key1(self) -> Floats:
        """(n, 3): the second key in cube units, without its rigid motion."""
        return self.to_cube(self.pair.key1, 1.0)

    @cached_property
    def weights(self) -> Floats:
        """(n,): vertex areas of the first key, with sum 1; loose vertices count as a small area."""
        areas = vertex_areas(self.key0, self.pair.faces)
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
    part = min(held / _MOST_HELD, 1.0)
    return 1.0 - part * part * (3.0 - 2.0 * part)
