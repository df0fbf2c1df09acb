# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A map rebuilt from its representation: the 3D linear Beltrami solver (Chen & Lui, section 3.3).

With A = det(P) P^-2 each coordinate of the map solves div(A grad u) = 0. The three systems share one stiffness matrix
and differ only in which vertices are held: u on the faces x = 0 and x = 1 of the cube, v on y, w on z (the other
faces slide), and the landmarks. On a piecewise linear map the rebuilding is exact up to rounding.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import cg

from .errors import ReconstructionError
from .representation import conductivity
from .stiffness import StiffnessPattern, stiffness_elements
from .tetmesh import Bools, Floats, Ints, TetMesh

_TOLERANCE = 1e-14
_MOST_ITERATIONS = 20_000


class Reconstructor:
    """Rebuilds maps of one tetrahedral mesh; the sparsity pattern and the held rows are set up once.

    Parameters
    ----------
    mesh : TetMesh
        Mesh of the unit cube.
    landmarks : (k,) int64, optional
        Vertices whose three coordinates are given, besides the sliding boundary.

    Raises
    ------
    ReconstructionError
        If a coordinate would be held nowhere.
    """

    def __init__(self, mesh: TetMesh, landmarks: Ints | None = None) -> None:
        self._mesh = mesh
        self._pattern = StiffnessPattern(mesh.tets, len(mesh.points))
        self._held = mesh.on_cube_face.copy()
        if landmarks is not None:
            self._held[landmarks] = True
        if not self._held.any(axis=0).all():
            raise ReconstructionError("A coordinate of the map is held nowhere; give boundary values or landmarks.")

    def rebuild(self, stretch: Floats, values: Floats, start: Floats | None = None) -> Floats:
        """The map whose representation is ``stretch``.

        Parameters
        ----------
        stretch : (M, 3, 3)
            Symmetric positive definite matrices.
        values : (N, 3)
            Read only where a coordinate is held: on its two cube faces and at the landmarks.
        start : (N, 3), optional
            A guess that shortens the iteration; the identity where it is not given.

        Returns
        -------
        (N, 3) values of the map at the mesh's vertices.

        Raises
        ------
        ReconstructionError
            If a stretch is not positive definite or the iteration does not converge.
        """
        elements = stiffness_elements(self._mesh.volumes, self._mesh.gradients, conductivity(stretch))
        matrix = self._pattern.assemble(elements)
        result = np.array(self._mesh.points if start is None else start, dtype=np.float64)
        for coordinate in range(3):
            held = self._held[:, coordinate]
            result[held, coordinate] = values[held, coordinate]
            result[~held, coordinate] = _solve_held(matrix, held, result[:, coordinate])
        return result


def _solve_held(matrix: csr_array, held: Bools, column: Floats) -> Floats:
    """Solve the free rows for their values, the held ones given; Jacobi-preconditioned conjugate gradients."""
    free = ~held
    inner = matrix[free][:, free]
    # Solving for the correction of the guess keeps the relative tolerance meaningful for good guesses.
    residual = -(matrix @ column)[free]
    scale = abs(matrix) @ np.abs(column)
    floor = _TOLERANCE * float(np.linalg.norm(scale[free]))
    preconditioner = diags_array(1.0 / inner.diagonal())
    step, status = cg(inner, residual, rtol=0.0, atol=floor, maxiter=_MOST_ITERATIONS, M=preconditioner)
    if status != 0:
        raise ReconstructionError("The reconstruction did not converge; the representation is too distorted.")
    return np.asarray(column[free] + step)
