# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The linear system of maps of the cube: factored once for a mesh, whatever the maps are to do."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU

from ..arrays import Floats, Ints
from ..numerics.assembly import StiffnessPattern, stiffness_elements
from ..numerics.nested_dissection import elimination_order, factored
from ..support.threads import in_threads
from ..tets.mesh import TetMesh


class VolumeSystem:
    """Solves for the map f whose Jacobians are nearest to given ones, for the sliding boundary of the cube.

    f minimizes ``sum v w |grad f - J|^2`` over the tetrahedra, with their volumes v and weights w. The matrix depends
    on the mesh and the weights only, and is factored once for each coordinate.

    Parameters
    ----------
    mesh : TetMesh
    insideness : (M,)
        Weights w of the tetrahedra: 1 inside the object, small outside.
    """

    def __init__(self, mesh: TetMesh, insideness: Floats) -> None:
        self.mesh = mesh
        self._weights = mesh.volumes * insideness
        elements = stiffness_elements(self._weights, mesh.gradients)
        matrix = StiffnessPattern(mesh.tets, len(mesh.points)).assemble(elements)
        order = elimination_order(mesh.points, matrix)

        def system(coordinate: int) -> tuple[Ints, SuperLU, Floats]:
            held = mesh.on_cube_face[:, coordinate]
            free, resting = order[~held[order]], np.flatnonzero(held)
            rows = matrix[free]
            return free, factored(csr_array(rows[:, free])), rows[:, resting] @ mesh.points[resting, coordinate]

        # For each coordinate: the vertices that may move along it, the factors, and the load of the fixed vertices.
        self._systems = list(in_threads(system, range(3)))

    def load(self, jacobians: Floats) -> Floats:
        """(N, 3) the load of wanted Jacobians (M, 3, 3)."""
        return self.mesh.divergence(self._weights[:, None, None] * jacobians)

    def solve(self, loads: Floats) -> Floats:
        """(k, N, 3) values of the maps for several loads (k, N, 3), together: the factors are read only once."""
        values = np.tile(self.mesh.points, (len(loads), 1, 1))
        for coordinate, (free, factors, held_load) in enumerate(self._systems):
            values[:, free, coordinate] = factors.solve((loads[:, free, coordinate] - held_load).T).T
        return values
