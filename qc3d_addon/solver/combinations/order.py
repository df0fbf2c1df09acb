# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The order of keys in a combination: the outer key carries along the places where the others bend."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..numerics.grouped_sums import sums_by_label
from ..numerics.rotations import rotation_matrices
from ..triangles.deformation import TriangleDeformation
from ..triangles.geometry import areas
from ..triangles.topology import face_adjacency
from .base import KeysOnBase

_MOVES = 0.01  # of a key's largest displacement; triangles that move less do not count as moved by the key
_TIE = 0.02  # relative; if two keys turn each other's bends this much alike, the order is open


def outermost_first(keys: KeysOnBase) -> tuple[int, ...]:
    """Indices of the keys, outermost first.

    Raising an arm carries its elbow along, but bending the elbow leaves the shoulder as it is. So the outer of two keys
    is the one that turns more where the other bends; if that is open, the one that moves more of the surface; and if
    that is open too, the first one.
    """
    bends = [Bend(keys, number) for number in range(len(keys.pairs))]
    points = [sum(carries(one, other) for other in bends if other is not one) for one in bends]
    return tuple(sorted(range(len(bends)), key=lambda number: (-points[number], -bends[number].moved)))


class Bend:
    """How a key turns triangles, how much it bends the surface around them, and how much of the surface it moves.

    Parameters
    ----------
    keys : KeysOnBase
    number : int
        Index of the key.

    Attributes
    ----------
    turns : (m, 3)
        Rotation vectors of the triangles, radians.
    angles : (m,)
        Angle by which each triangle turns, radians.
    bent : (m,)
        Sum of the angles between each triangle and its neighbors, radians, times the square root of its area.
    moved : float
        Area that the key moves.
    """

    def __init__(self, keys: KeysOnBase, number: int) -> None:
        base, shape = (each[keys.vertices] for each in (keys.base, keys.pairs[number].key1))
        sizes = areas(base, keys.faces)
        deformation = TriangleDeformation.between(base, shape, keys.faces)
        self.turns: Floats = np.zeros((len(sizes), 3))
        self.turns[deformation.rows] = deformation.turns
        self.angles: Floats = np.linalg.norm(self.turns, axis=1)
        adjacency = face_adjacency(deformation.faces)
        rotations = rotation_matrices(deformation.turns)
        # The norm of R - S is 2 sqrt(2) sin(a / 2) for the angle a of the rotation between them.
        between = np.linalg.norm(rotations[adjacency[:, 0]] - rotations[adjacency[:, 1]], axis=(1, 2)) / np.sqrt(2.0)
        around = sums_by_label(deformation.rows[adjacency.T.ravel()], np.tile(between, 2), len(sizes))
        self.bent: Floats = around * np.sqrt(sizes)
        travel = np.linalg.norm(shape - base, axis=1)[keys.faces].mean(axis=1)
        self.moved = float(sizes[travel > _MOVES * float(travel.max(initial=0.0))].sum())


def carries(one: Bend, other: Bend) -> float:
    """1 if the first key carries the other, 0 if the other carries the first, 1/2 if that is open."""
    outward, inward = float(one.angles @ other.bent), float(other.angles @ one.bent)
    return 0.5 if np.isclose(outward, inward, rtol=_TIE, atol=0.0) else float(outward > inward)
