# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reconstruction of a map from its representation (Chen & Lui, sections 5.2 and 5.3).

With A = det(P) P⁻², each coordinate u of the map solves div(A grad u) = 0. The three systems share one stiffness matrix
and differ only in their boundary conditions: on the sliding cube u is fixed on the faces x = 0 and x = 1, v on y, w on
z, and all at landmarks. For a piecewise linear map, the reconstruction is exact up to rounding on the sliding cube and
on any mesh whose whole boundary is fixed.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import cg

from ..arrays import Bools, Floats
from ..errors import ReconstructionError
from ..numerics.assembly import StiffnessPattern, stiffness_elements
from ..tets.mesh import TetMesh
from .boundary_conditions import Conditions
from .mapping import Mapping
from .representation import conductivity

_TOLERANCE = 1e-14  # of the size of the terms in each row: about rounding
_MOST_ITERATIONS = 20_000  # a cap for very distorted representations


def reconstruct(mesh: TetMesh, stretch: Floats, conditions: Conditions) -> Mapping:
    """Reconstruct the map with a given representation and boundary conditions.

    Parameters
    ----------
    mesh : TetMesh
        Any tetrahedral mesh.
    stretch : (M, 3, 3)
        Symmetric positive definite matrices, one for each tetrahedron.
    conditions : Conditions
        Boundary conditions and landmarks.

    Raises
    ------
    ReconstructionError
        If shapes disagree, a stretch is not symmetric positive definite, the conditions do not determine the map, or
        the iteration does not converge.
    """
    if stretch.shape != (len(mesh.tets), 3, 3):
        raise ReconstructionError(
            f"The representation has the shape {stretch.shape}; the mesh's {len(mesh.tets)} tetrahedra need "
            f"{(len(mesh.tets), 3, 3)}."
        )
    if not np.array_equal(stretch, stretch.transpose(0, 2, 1)):
        raise ReconstructionError("The representation holds matrices that are not symmetric, or not finite.")
    if conditions.held.shape != mesh.points.shape:
        raise ReconstructionError("The conditions were made for another mesh.")
    conditions.require_enough(mesh)
    return Mapping(mesh, Reconstructor(mesh, conditions.held).rebuild(stretch, conditions.values))


class Reconstructor:
    """Reconstructs maps of one tetrahedral mesh. The sparsity pattern and the boundary rows are set up once.

    Parameters
    ----------
    mesh : TetMesh
        Any tetrahedral mesh; a mesh of the unit cube if ``held`` is omitted.
    held : (N, 3) bool, optional
        Which coordinates of which vertices are prescribed; by default those of the sliding cube.

    Raises
    ------
    ReconstructionError
        If a coordinate is prescribed nowhere.
    """

    def __init__(self, mesh: TetMesh, held: Bools | None = None) -> None:
        self._mesh = mesh
        self._pattern = StiffnessPattern(mesh.tets, len(mesh.points))
        self._held = mesh.on_cube_face if held is None else held
        if not self._held.any(axis=0).all():
            raise ReconstructionError("A coordinate of the map is held nowhere; give boundary values or landmarks.")
        self._unused = np.ones(len(mesh.points), dtype=bool)
        self._unused[mesh.tets] = False

    def rebuild(self, stretch: Floats, values: Floats, start: Floats | None = None) -> Floats:
        """Reconstruct the map whose representation is ``stretch``.

        Parameters
        ----------
        stretch : (M, 3, 3)
            Symmetric positive definite matrices.
        values : (N, 3)
            Prescribed values; other entries are ignored.
        start : (N, 3), optional
            Initial guess, the identity by default. Vertices without a tetrahedron stay there.

        Returns
        -------
        (N, 3)
            Values of the map at the mesh's vertices.

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
            free = ~(held | self._unused)
            result[free, coordinate] = _solve(matrix, free, result[:, coordinate])
        return result


def _solve(matrix: csr_array, free: Bools, column: Floats) -> Floats:
    """Solve for the free entries of a column by conjugate gradients with Jacobi preconditioning."""
    inner = matrix[free][:, free]
    # Solving for the correction keeps the tolerance meaningful if the initial guess is good.
    residual = -(matrix @ column)[free]
    scale = abs(matrix) @ np.abs(column)
    floor = _TOLERANCE * float(np.linalg.norm(scale[free]))
    preconditioner = diags_array(1.0 / inner.diagonal())
    step, status = cg(inner, residual, rtol=0.0, atol=floor, maxiter=_MOST_ITERATIONS, M=preconditioner)
    if status != 0:
        raise ReconstructionError("The reconstruction did not converge; the representation is too distorted.")
    return np.asarray(column[free] + step)
