# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Single frames, and the certificates of their maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..fit.fitted_map import FittedMap
from ..numerics.rotations import determinants
from .alignment import RigidMove
from .report import Certificate


@dataclass(frozen=True, eq=False)
class Frame:
    """An in-between of a pair of keys.

    Parameters
    ----------
    positions : (n, 3)
        In the keys' coordinates.
    crossings : int or None
        Pairs of triangles that cross beyond what the worse of the two keys has; None where that is not known.
    values : (N, 3), optional
        The frame's map, cube units; none in mode ``straight``.
    certificate : Certificate, optional
        What that map's determinants say.
    """

    positions: Floats
    crossings: int | None
    values: Floats | None = None
    certificate: Certificate | None = None

    @classmethod
    def of(
        cls,
        fitted: FittedMap,
        positions: Floats,
        values: Floats,
        time: float,
        repaired: bool,
        crossings: int | None,
        move: RigidMove | None = None,
    ) -> Frame:
        """A frame at ``time`` from its positions (n, 3), keys' coordinates, and its map's values (N, 3) in the cube.

        ``move`` carries the map to the frame.
        """
        determinant = determinants(fitted.mesh.jacobians(values))
        worst = int(np.argmin(determinant))
        middle = values[fitted.mesh.tets[worst]].mean(axis=0)[None]
        place = fitted.embedding.from_cube(middle if move is None else move.apply(middle), time)[0]
        folds = int((determinant <= 0.0).sum())
        carried = fitted.embedding.from_cube(fitted.landmarks @ values, time)
        missed = float(np.linalg.norm((positions - carried) / fitted.pair.diagonal, axis=1).max())
        certificate = Certificate(time, folds, float(determinant[worst]), place.tolist(), repaired, missed)
        return cls(positions, crossings, values, certificate)
