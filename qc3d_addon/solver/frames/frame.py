# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One in-between, with the proof that its map has no folds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats
from ..fit.fitted_map import PreparedMap
from ..numerics.rotations import determinants


@dataclass(frozen=True, eq=False)
class Frame:
    """An in-between of a prepared pair.

    Parameters
    ----------
    positions : (n, 3)
        In the keys' coordinates.
    values : (N, 3)
        The frame's map, cube units.
    smallest_determinant : float
        The smallest Jacobian determinant of the frame's map of the cube; positive means no folds.
    place : (3,)
        Where that is, in the keys' coordinates.
    folds : int
        Tetrahedra that are not kept positively oriented.
    repaired : bool
        Whether folds of the predicted map had to be removed.
    crossings : int
        Pairs of triangles that cross beyond what the worse of the two keys has.
    """

    positions: Floats
    values: Floats
    smallest_determinant: float
    place: Floats
    folds: int
    repaired: bool
    crossings: int

    @classmethod
    def of(
        cls, prepared: PreparedMap, positions: Floats, values: Floats, time: float, repaired: bool, crossings: int
    ) -> Frame:
        """A frame at ``time`` from its positions (n, 3), keys' coordinates, and its map's values (N, 3) in the cube."""
        determinant = determinants(prepared.mesh.jacobians(values))
        worst = int(np.argmin(determinant))
        embedding = prepared.embedding
        place = embedding.from_cube(values[prepared.mesh.tets[worst]].mean(axis=0)[None], time)[0]
        folds = int((determinant <= 0.0).sum())
        return cls(positions, values, float(determinant[worst]), place, folds, repaired, crossings)

    def certificate(self, time: float) -> dict[str, Any]:
        """Plain values for the report."""
        return {
            "time": time,
            "folds": self.folds,
            "smallest_determinant": self.smallest_determinant,
            "place": [float(coordinate) for coordinate in self.place],
            "repaired": self.repaired,
        }
