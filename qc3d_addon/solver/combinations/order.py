# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of several keys is the outer one: it carries along the places where the others bend."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..numerics.grouped_sums import sums_by_label
from ..numerics.rotations import rotation_matrices
from ..triangles.deformation import TriangleDeformation
from ..triangles.geometry import areas
from ..triangles.topology import face_adjacency
from .base import KeysOnBase

# Of the farthest travel of a key: what moves less is not what the key is about.
_MOVES = 0.01
# Of each other: two keys that turn each other's bends this much alike carry each other.
_TIE = 0.02


def outermost_first(keys: KeysOnBase) -> tuple[int, ...]:
    """Numbers of the keys, the outermost first.

    An arm that is raised carries its elbow along, and bending the elbow leaves the shoulder as it is: the outer of two
    keys is the one that turns more where the other bends. Where that leaves it open, the one that moves more of the
    surface; then the one that is named first.
    """
    bends = [Bend(keys, number) for number in range(len(keys.pairs))]
    points = [sum(carries(one, other) for other in bends if other is not one) for one in bends]
    return tuple(sorted(range(len(bends)), key=lambda number: (-points[number], -bends[number].moved)))


class Bend:
    """How a key turns triangles, how much it bends the surface around each, and how much of it the key moves.

    Parameters
    ----------
    keys : KeysOnBase
    number : int
        Of the key.

    Attributes
    ----------
    turns : (m, 3)
        Rotation vectors of the triangles, radians.
    angles, bent : (m,)
        How far each triangle turns, and how far its neighbors turn beside it, radians times the root of its area.
    moved : float
        Area of what moves.
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
    """1 where the first key carries the other, 0 where the other carries it, and a half where that is open."""
    outward, inward = float(one.angles @ other.bent), float(other.angles @ one.bent)
    return 0.5 if np.isclose(outward, inward, rtol=_TIE, atol=0.0) else float(outward > inward)
