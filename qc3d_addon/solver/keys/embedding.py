# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The embedding of both keys of a pair in the unit cube, and the way back for frames."""

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

STILL_TOLERANCE = 1e-6  # of the diagonal: above rounding in single precision, below what an animator would pose
# Distance of the keys from the cube's faces: the volume around them needs room to move, and in-betweens may reach a
# little beyond both keys.
MARGIN = 0.17


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
        source_centre, target_centre = weights @ source, weights @ target
        covariance = (target - target_centre).T @ (weights[:, None] * (source - source_centre))
        return cls._of_turn(best_turns(covariance[None])[0], source_centre, target_centre)

    @classmethod
    def of_surface(cls, source: Floats, target: Floats, faces: Ints) -> RigidMotion:
        """Mean rigid motion of a surface from the shape ``source`` (n, 3) to the shape ``target`` (n, 3).

        The rotation is the area-weighted mean of the triangles' unwrapped rotations; the translation carries the
        centroid along. Without usable triangles, it is the least-squares fit of the positions. That fit would be wrong
        where wings flap or ends twist: there it can be half a turn away from the rotation of every triangle.
        """
        weights = vertex_areas(source, faces)
        vertices, group = welded(source, target)
        deformation = TriangleDeformation.between(source[vertices], target[vertices], group[faces])
        if not len(deformation.faces):
            return cls.between(source, target, weights)
        # Symmetric in both keys, and independent of their scale.
        sizes = np.sqrt(np.prod([areas(key[vertices], deformation.faces) for key in (source, target)], axis=0))
        turn = mean_turn(deformation.turns, face_adjacency(deformation.faces), sizes)
        return cls._of_turn(turn, *(np.average(key, axis=0, weights=weights) for key in (source, target)))

    @classmethod
    def _of_turn(cls, turn: Floats, source_centre: Floats, target_centre: Floats) -> RigidMotion:
        shift = target_centre - rotation_matrices(turn[None])[0] @ source_centre
        return cls(turn, np.linalg.solve(translation_factors(turn[None])[0], shift))

    @property
    def rotation(self) -> Floats:
        """(3, 3) rotation matrix of the whole motion."""
        return np.asarray(rotation_matrices(self.turn[None])[0])

    def apply(self, points: Floats, time: float = 1.0) -> Floats:
        """Points (n, 3) moved along the screw up to ``time``: 0 is the start, 1 the whole motion."""
        turn = time * self.turn
        rotation = rotation_matrices(turn[None])[0]
        return np.asarray(points @ rotation.T + translation_factors(turn[None])[0] @ (time * self.velocity))

    def undo(self, points: Floats) -> Floats:
        """Points (n, 3) moved by the inverse of the whole motion."""
        return self.apply(points, -1.0)


@dataclass(frozen=True, eq=False)
class Embedding:
    """How a pair lies in the unit cube: one similarity for both keys, and the rigid motion removed from the second.

    Parameters
    ----------
    pair : KeyPair
    still : (n,) bool
        Still vertices: those that both keys leave in place. If there are any, ``motion`` is the identity.
    motion : RigidMotion
        Mean rigid motion of the surface from the first key to the second, in the keys' own units.
    centre : (3,)
        The point that goes to the center of the cube.
    scale : float
        Cube units per unit of the keys.
    """

    pair: KeyPair
    still: Bools
    motion: RigidMotion
    centre: Floats
    scale: float

    @classmethod
    def of(cls, pair: KeyPair) -> Embedding:
        """Embed a pair so that both keys, the second without its rigid motion, just fit into [0.17, 0.83]³."""
        still = np.linalg.norm(pair.key1 - pair.key0, axis=1) <= STILL_TOLERANCE * pair.diagonal
        motion = (
            RigidMotion.identity() if still.any() else RigidMotion.of_surface(pair.key0, pair.key1, pair.faces)
        )
        both = np.concatenate([pair.key0, motion.undo(pair.key1)])
        low, high = both.min(axis=0), both.max(axis=0)
        size = float((high - low).max())
        scale = (1.0 - 2.0 * MARGIN) / (size if size > 0.0 else pair.diagonal)
        return cls(pair, still, motion, 0.5 * (low + high), scale)

    def to_cube(self, points: Floats) -> Floats:
        """Points (k, 3) in cube units, given in the keys' units."""
        return np.asarray((points - self.centre) * self.scale + 0.5)

    def from_cube(self, points: Floats, time: float) -> Floats:
        """Points (k, 3) in the keys' units, given in cube units, moved along the rigid motion up to ``time`` (0..1)."""
        return self.motion.apply((points - 0.5) / self.scale + self.centre, time)

    def vectors_to_cube(self, vectors: Floats, time: float) -> Floats:
        """Displacements (k, 3) at ``time`` in cube units, given in the keys' units: ``from_cube`` inverted."""
        rotation = rotation_matrices(time * self.motion.turn[None])[0]
        return np.asarray(self.scale * (vectors @ rotation))

    @cached_property
    def key0(self) -> Floats:
        """(n, 3) the first key in cube units."""
        return self.to_cube(self.pair.key0)

    @cached_property
    def key1(self) -> Floats:
        """(n, 3) the second key in cube units, without its rigid motion."""
        return self.to_cube(self.motion.undo(self.pair.key1))

    @cached_property
    def weights(self) -> Floats:
        """(n,) vertex areas of the first key, normalized to the sum 1; a loose vertex has a small positive weight."""
        areas = vertex_areas(self.key0, self.pair.faces)
        return np.asarray(areas / areas.sum())
