# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fold-free maps of the cube with a sliding boundary and soft landmark constraints.

The energy is the sum of a conformal and a volume term (Garanzha et al. 2021, "Foldover-free maps in 50 lines of code").
It is infinite on folded elements, so a line search that starts at a map without folds only reaches such maps. It is
minimized by Gauss-Newton steps, whose element blocks are projected to positive semi-definite matrices, and which are
solved by preconditioned conjugate gradients. Distant targets are approached along a path (module ``continuation``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_array, csr_array, diags_array

from ..arrays import Bools, Floats
from ..numerics.assembly import StiffnessPattern
from ..numerics.conjugate_gradients import conjugate_gradients
from ..numerics.rotations import cofactors, determinants
from ..tets.mesh import TetMesh
from .energy_density import derivatives, energy_density, projected_blocks

LANDMARK_WEIGHT = 1e4  # a larger one lowers the residual little and slows down conjugate gradients
_RELATIVE_DECREASE = 1e-4  # of the energy, predicted for a full step; less ends the iteration
_CG_TOLERANCE = 1e-3  # relative; a Newton direction need not be more accurate than its quadratic model
_CG_ITERATIONS = 400  # at most
_BACKTRACKS = 12  # halvings of the step before the line search gives up


class FoldFreeFitter:
    """Fits maps of one mesh to landmark targets. Everything that does not depend on the targets is set up once.

    Parameters
    ----------
    mesh : TetMesh
        A mesh of the unit cube.
    landmarks : (n, N) sparse
        Barycentric coordinates of the landmarks: a map with values (N, 3) sends them to ``landmarks @ values``.
    weights : (n,)
        Positive weights of the landmarks, with the sum 1 or, for landmarks that pull harder, more.
    """

    def __init__(self, mesh: TetMesh, landmarks: csr_array, weights: Floats) -> None:
        self.mesh = mesh
        self.landmarks = landmarks
        self._weights = weights
        self._tet_weights = mesh.volumes
        self._free = ~mesh.on_cube_face
        self._pattern = StiffnessPattern(mesh.tets, len(mesh.points))
        # Landmarks lie inside tetrahedra, so their normal matrix has the sparsity pattern of the mesh.
        self._landmark_matrix = csr_array(landmarks.T @ diags_array(weights) @ landmarks)
        self._landmark_blocks = self._blocks_of(self._landmark_matrix)

    def fit(self, start: Floats, targets: Floats, most_iterations: int) -> Floats:
        """Minimize the energy, starting at a map without folds.

        Parameters
        ----------
        start : (N, 3)
            Values of a map without folds, cube units. Coordinates fixed by the cube's faces do not change.
        targets : (n, 3)
            Targets of the landmarks, cube units.
        most_iterations : int
            Largest number of Gauss-Newton steps.

        Returns
        -------
        (N, 3)
            Values of a map without folds.
        """
        values, before = start, 1.0
        misfit = self.misfit(start, targets)
        for _ in range(most_iterations):
            energy, gradient, blocks = self._model(values, misfit)
            step = self._newton_step(gradient, blocks)
            slope = float((gradient * step).sum())
            length, values = self._line_search(values, step, energy, slope, misfit)
            # After a shortened step, a short full one only tells that a tetrahedron which limited it opens up again.
            if length == 0.0 or (length == before == 1.0 and self._settled(-slope, energy)):
                break
            before = length
        return values

    def _settled(self, decrease: float, energy: float) -> bool:
        """Whether a full step that is to lower the energy by so much was the last."""
        return decrease < _RELATIVE_DECREASE * energy

    def residuals(self, values: Floats, targets: Floats) -> Floats:
        """(n, 3) residuals: landmark positions under a map with ``values`` (N, 3), minus their targets (n, 3)."""
        return np.asarray(self.landmarks @ values - targets)

    def misfit(self, origin: Floats, targets: Floats) -> Misfit:
        """The quadratic landmark penalty for ``targets`` (n, 3), expanded about the map ``origin`` (N, 3)."""
        residuals = self.residuals(origin, targets)
        at_origin = 0.5 * LANDMARK_WEIGHT * float(self._weights @ (residuals**2).sum(axis=1))
        slope = LANDMARK_WEIGHT * (self.landmarks.T @ (self._weights[:, None] * residuals))
        return Misfit(origin, at_origin, np.asarray(slope), self._landmark_matrix)

    def _energy(self, values: Floats, misfit: Misfit) -> float:
        """Energy of a map; infinite if the map has a fold."""
        jacobians = self.mesh.jacobians(values)
        determinant = determinants(jacobians)
        if determinant.min() <= 0.0:
            return np.inf
        density = energy_density(np.einsum("mij,mij->m", jacobians, jacobians), determinant)
        return float(self._tet_weights @ density) + misfit.at(values)[0]

    def _model(self, values: Floats, misfit: Misfit) -> tuple[float, Floats, Floats]:
        """Energy, gradient (N, 3) and projected element blocks (M, 4, 4, 3, 3) of the Gauss-Newton matrix."""
        jacobians = self.mesh.jacobians(values)
        weights = self._tet_weights
        squares = np.einsum("mij,mij->m", jacobians, jacobians)
        cofactor = cofactors(jacobians)
        terms = derivatives(squares, determinants(jacobians))
        stress = terms.linear[:, None, None] * jacobians + terms.slope[:, None, None] * cofactor
        missed, misfit_gradient = misfit.at(values)
        gradient = self.mesh.divergence(weights[:, None, None] * stress) + misfit_gradient
        gradient[~self._free] = 0.0
        blocks = projected_blocks(weights, self.mesh.gradients, jacobians, cofactor, squares, terms)
        return float(weights @ terms.density) + missed, gradient, blocks

    def _newton_step(self, gradient: Floats, element_blocks: Floats) -> Floats:
        matrix = self._pattern.assemble_blocks(element_blocks)
        matrix.data += LANDMARK_WEIGHT * self._landmark_blocks
        free = self._free.ravel()
        diagonal = _diagonal_blocks(matrix)
        inverse = np.linalg.inv(_restricted(diagonal, self._free))

        def precondition(vector: Floats) -> Floats:
            return np.asarray(np.einsum("nij,nj->ni", inverse, vector.reshape(-1, 3)).ravel() * free)

        def multiply(vector: Floats) -> Floats:
            return np.asarray(matrix @ (vector * free) * free)

        # Every iterate of CG that starts at zero is a descent direction, also the one at which the iterations run out
        # (inexact Newton; Nocedal & Wright 2006, section 7.1). The line search judges it, however many there were.
        step, _ = conjugate_gradients(multiply, precondition, -gradient.ravel(), _CG_TOLERANCE, (0, _CG_ITERATIONS))
        return step.reshape(-1, 3)

    def _line_search(
        self, values: Floats, step: Floats, energy: float, slope: float, misfit: Misfit
    ) -> tuple[float, Floats]:
        """The first length of 1, 1/2, 1/4, ... that satisfies the Armijo condition, and its map; length 0 if none."""
        length = 1.0
        for _ in range(_BACKTRACKS):
            moved = values + length * step
            if self._energy(moved, misfit) <= energy + 1e-4 * length * slope:
                return length, moved
            length *= 0.5
        return 0.0, values

    def _blocks_of(self, matrix: csr_array) -> Floats:
        """(entries, 3, 3) blocks, multiples of the identity, of a scalar matrix in the mesh's sparsity pattern."""
        pattern = self._pattern.assemble(np.zeros((len(self.mesh.tets), 4, 4)))
        rows = np.repeat(np.arange(pattern.shape[0]), np.diff(pattern.indptr))
        values = np.zeros(len(pattern.indices))
        codes = rows * pattern.shape[0] + pattern.indices
        entries = matrix.tocoo()
        places = np.searchsorted(codes, entries.row.astype(np.int64) * pattern.shape[0] + entries.col)
        values[places] = entries.data
        return np.asarray(values[:, None, None] * np.eye(3))


@dataclass(frozen=True, eq=False)
class Misfit:
    """The quadratic landmark penalty, expanded about one map, so that it can be evaluated without the landmarks.

    Parameters
    ----------
    origin : (N, 3)
        Values of the map about which it is expanded.
    at_origin : float
        Penalty of that map.
    slope : (N, 3)
        Gradient of the penalty there.
    matrix : (N, N) sparse
        Weighted normal matrix of the landmarks.
    """

    origin: Floats
    at_origin: float
    slope: Floats
    matrix: csr_array

    def at(self, values: Floats) -> tuple[float, Floats]:
        """Penalty of a map with ``values`` (N, 3), and its gradient (N, 3)."""
        change = values - self.origin
        curved = LANDMARK_WEIGHT * (self.matrix @ change)
        cost = self.at_origin + float((change * (self.slope + 0.5 * curved)).sum())
        return cost, np.asarray(self.slope + curved)


def _diagonal_blocks(matrix: bsr_array) -> Floats:
    rows = np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))
    return np.asarray(matrix.data[rows == matrix.indices])


def _restricted(blocks: Floats, free: Bools) -> Floats:
    """Diagonal blocks in which fixed coordinates are decoupled from free ones."""
    kept = blocks * (free[:, :, None] & free[:, None, :])
    kept[:, np.arange(3), np.arange(3)] += ~free
    return np.asarray(kept)
