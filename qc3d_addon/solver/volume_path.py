# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The map of the cube on its way from the identity to the fitted map, rotation kept."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from .branches import Turning
from .factorization import dissection_order, factored
from .representation import polar_decomposition
from .stiffness import StiffnessPattern, scatter, stiffness_elements
from .stretch import Stretch, StretchLaw
from .tetmesh import Floats, TetMesh


class VolumePath:
    """Maps between the identity and a fitted map by interpolated rotations and stretches.

    Values minimise ``sum v w |grad f - R_t P_t|^2`` over the tetrahedra with the sliding boundary of the cube, with R_t
    from ``turning``. The matrix does not depend on the time and is factored once per coordinate.

    Parameters
    ----------
    mesh : TetMesh
    mapped : (N, 3)
        The fitted map, without folds.
    turning : Turning
        How the tetrahedra turn.
    insideness : (M,)
        What the tetrahedra count besides their volume: most inside the object.
    law : StretchLaw
    """

    def __init__(self, mesh: TetMesh, mapped: Floats, turning: Turning, insideness: Floats, law: StretchLaw) -> None:
        self._mesh = mesh
        self._turning = turning
        self._stretch = Stretch.of(polar_decomposition(mesh.jacobians(mapped)).stretch)
        self._law = law
        weights = mesh.volumes * insideness
        self._weighted_gradients = weights[:, None, None] * mesh.gradients
        matrix = StiffnessPattern(mesh.tets, len(mesh.points)).assemble(stiffness_elements(weights, mesh.gradients))
        self._held = mesh.on_cube_face
        order = dissection_order(mesh.points, matrix)
        self._systems = []
        for coordinate in range(3):
            held = np.flatnonzero(self._held[:, coordinate])
            free = order[~self._held[order, coordinate]]
            rows = matrix[free]
            held_load = rows[:, held] @ mesh.points[held, coordinate]
            self._systems.append((free, factored(csr_array(rows[:, free])), held_load))

    def at(self, time: float) -> Floats:
        """(N, 3) values of the map at ``time`` in 0..1; it may have folds where the motion is extreme."""
        wanted = self._turning.at(time) @ self._stretch.at(time, self._law)
        load = scatter(self._mesh.tets, self._weighted_gradients @ wanted.transpose(0, 2, 1), len(self._mesh.points))
        values = self._mesh.points.copy()
        for coordinate, (free, factors, held_load) in enumerate(self._systems):
            values[free, coordinate] = factors.solve(load[free, coordinate] - held_load)
        return values
