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
from scipy.sparse import csr_array

from ..arrays import Bools, Floats
from ..errors import ReconstructionError
from ..numerics.assembly import StiffnessPattern, stiffness_elements
from ..tets.mesh import TetMesh
from .boundary_conditions import Conditions
from .mapping import Mapping
from .representation import conductivity

_MOST_ITERATIONS = 20_000
# An iteration is at its end when the last ten steps and a tenth of those before move nothing by more than rounding, in
# parts of the values' range. It is corrected until that moves little, or as little as the matrix allows.
_STILL, _LEAST_STEPS, _PART_OF_STEPS = 1e-14, 10, 10
_SETTLED, _MOST_CORRECTIONS = 1e-12, 10


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

    Examples
    --------
    >>> from qc3d_addon.solver.maps.boundary_conditions import Conditions
    >>> from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid
    >>> grid = kuhn_grid(2)
    >>> mapping = Mapping(grid, grid.points + 0.1 * grid.points[:, [1, 2, 0]])
    >>> conditions = Conditions.fixed_boundary(grid, mapping.values)
    >>> bool(abs(reconstruct(grid, mapping.stretch, conditions).values - mapping.values).max() < 1e-12)
    True
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
            # In the middle of what each part is held at, no digits are spent on where the mesh lies.
            middles, spans = self._ranges(result[:, coordinate], held & ~self._unused)
            solution = _solve(matrix, free, result[:, coordinate] - middles, spans)
            result[free, coordinate] = solution + middles[free]
        return result

    def _ranges(self, column: Floats, held: Bools) -> tuple[Floats, Floats]:
        """(N,) each: the middle of the values at which a vertex's part is held, and how far apart they are."""
        part, count = self._mesh.parts
        lowest, highest = np.full(count + 1, np.inf), np.full(count + 1, -np.inf)
        np.minimum.at(lowest, part[held], column[held])
        np.maximum.at(highest, part[held], column[held])
        missing = ~(highest >= lowest)  # no part at all, or held nowhere
        lowest[missing] = highest[missing] = 0.0
        spans = highest - lowest
        spans[spans == 0.0] = 1.0
        return 0.5 * (lowest + highest)[part], spans[part]


def _solve(matrix: csr_array, free: Bools, column: Floats, spans: Floats) -> Floats:
    """Solve the free rows for their values, the others given; rows are of the size of ``spans``."""
    inner = csr_array(matrix[free][:, free])
    column = np.array(column)
    last = np.inf
    for _ in range(_MOST_CORRECTIONS):
        # Solving for the correction of the guess: rounding in the iteration is made up for by the next one.
        step = _conjugate_gradients(inner, -(matrix @ column)[free], spans[free])
        column[free] += step
        moved = float((np.abs(step) / spans[free]).max(initial=0.0))
        if moved < _SETTLED or moved > 0.5 * last:
            break
        last = moved
    return np.asarray(column[free])


def _conjugate_gradients(matrix: csr_array, right: Floats, spans: Floats) -> Floats:
    """Conjugate gradients, Jacobi-preconditioned, until the solution stops moving.

    Residuals are no measure: where a map is very distorted, tiny ones leave large errors.
    """
    found = np.zeros_like(right)
    inverse = 1.0 / matrix.diagonal()
    residual = right
    direction = inverse * residual
    product = float(residual @ direction)
    moves: list[float] = []
    while product > 0.0:
        if len(moves) == _MOST_ITERATIONS:
            raise ReconstructionError("The reconstruction did not converge; the representation is too distorted.")
        image = matrix @ direction
        factor = product / float(direction @ image)
        step = factor * direction
        found += step
        residual = residual - factor * image
        moves.append(float((np.abs(step) / spans).max()))
        recent = _LEAST_STEPS + len(moves) // _PART_OF_STEPS
        if len(moves) > recent and sum(moves[-recent:]) < _STILL:
            break
        preconditioned = inverse * residual
        following = float(residual @ preconditioned)
        direction = preconditioned + following / product * direction
        product = following
    return found
