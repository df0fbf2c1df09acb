# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients whose rebuilt map is nearest to a given one, not those whose representation is.

The logarithm of the representation, L = log P, is a sum of modes; the rebuilding solves K(A) u = 0 for each coordinate
with A = det(P) P^-2 = exp(tr(L) I - 2 L). The squared distance of the rebuilt map from its target has an exact gradient
at the cost of three more solutions (the adjoint ones), so a quasi-Newton method finds the coefficients (L-BFGS).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import cg

from ..arrays import Floats
from ..errors import ReconstructionError
from ..maps.boundary_conditions import Conditions
from ..maps.representation import from_upper_triangle, upper_triangle
from ..numerics.assembly import StiffnessPattern, stiffness_elements
from ..tets.mesh import TetMesh

# Off-diagonal entries count twice in the norm of a symmetric matrix.
NORM = np.sqrt(np.array([1.0, 2.0, 2.0, 1.0, 2.0, 1.0]))
# No real map stretches by more than exp of this, about 20,000; beyond it rounding could spoil definiteness.
MOST_LOGARITHM = 10.0
_TOLERANCE = 1e-7
_MOST_ITERATIONS = 5000
_CORRECTIONS = 20
_SMALL = 1e-4


@dataclass(frozen=True, eq=False)
class NearestMap:
    """Looks for coefficients of one mesh.

    Parameters
    ----------
    mesh : TetMesh
    conditions : Conditions
        Where the rebuilt map is given.
    observed : (n, N) sparse array
        What is compared with the target: these combinations of the map's values.
    """

    mesh: TetMesh
    conditions: Conditions
    observed: csr_array

    def coefficients(self, at_tets: Floats, start: Floats, scales: Floats, target: Floats, iterations: int) -> Floats:
        """(k, 6) coefficients of log P, off-diagonal channels times the root of two.

        Parameters
        ----------
        at_tets : (M, k)
            The modes on the tetrahedra.
        start : (k, 6)
            Where to begin.
        scales : (k,)
            How far the coefficients of each mode move for the same change of the map.
        target : (n, 3)
        iterations : int
            At most so many steps. The search ends earlier, at the nearest map that it has seen, where it comes to one
            that conjugate gradients do not solve for.

        Raises
        ------
        ReconstructionError
            If the map of ``start`` itself cannot be solved for.
        """
        from scipy.optimize import minimize  # takes memory, and time to load

        search = _Search(self, at_tets, scales, target)
        try:
            nearest = minimize(
                search.value_and_gradient,
                (start / scales[:, None]).ravel(),
                jac=True,
                method="L-BFGS-B",
                options={"maxiter": iterations, "maxcor": _CORRECTIONS},
            ).x
        except ReconstructionError:
            if search.nearest is None:
                raise
            nearest = search.nearest
        return np.asarray(np.reshape(nearest, (len(scales), 6)) * scales[:, None])


class _Search:
    def __init__(self, problem: NearestMap, at_tets: Floats, scales: Floats, target: Floats) -> None:
        self._problem, self._at_tets, self._scales, self._target = problem, at_tets, scales, target
        self.nearest: Floats | None = None
        self._nearest_distance = np.inf
        self._pattern = StiffnessPattern(problem.mesh.tets, len(problem.mesh.points))
        given = problem.conditions
        self._values = np.where(given.held, given.values, problem.mesh.points)
        self._adjoint = np.zeros_like(self._values)
        # The distance of the start's target from the identity is the unit, so that the method's own tolerances fit.
        reference = float(((problem.observed @ problem.mesh.points - target) ** 2).sum())
        self._unit = reference if reference > 0.0 else 1.0

    def value_and_gradient(self, numbers: Floats) -> tuple[float, Floats]:
        """The squared distance, over that of the identity, and its gradient with respect to the scaled coefficients."""
        mesh, observed = self._problem.mesh, self._problem.observed
        coefficients = numbers.reshape(-1, 6) * self._scales[:, None]
        logarithm = from_upper_triangle(self._at_tets @ coefficients / NORM)
        stretches, axes = np.linalg.eigh(logarithm)
        stretches = np.clip(stretches, -MOST_LOGARITHM, MOST_LOGARITHM)
        exponents = stretches.sum(axis=1, keepdims=True) - 2.0 * stretches
        conductivity = (axes * np.exp(exponents)[:, None]) @ axes.transpose(0, 2, 1)
        matrix = self._pattern.assemble(stiffness_elements(mesh.volumes, mesh.gradients, conductivity))
        self._solve(matrix, self._values, np.zeros_like(self._values))
        missed = observed @ self._values - self._target
        self._solve(matrix, self._adjoint, np.asarray(observed.T @ missed))
        gradients = mesh.gradients.transpose(0, 2, 1)
        forward, backward = gradients @ self._values[mesh.tets], gradients @ self._adjoint[mesh.tets]
        slope = -mesh.volumes[:, None, None] * (backward @ forward.transpose(0, 2, 1))
        slope = _through_exponential(0.5 * (slope + slope.transpose(0, 2, 1)), exponents, axes)
        slope = np.einsum("mii->m", slope)[:, None, None] * np.eye(3) - 2.0 * slope
        gradient = self._at_tets.T @ (upper_triangle(slope) * NORM) * self._scales[:, None]
        distance = float((missed**2).sum()) / self._unit
        if distance < self._nearest_distance:
            self.nearest, self._nearest_distance = numbers.copy(), distance
        return distance, 2.0 / self._unit * gradient.ravel()

    def _solve(self, matrix: csr_array, values: Floats, loads: Floats) -> None:
        """Solve for the free values in place, beginning where they are; raises ReconstructionError if that fails."""
        used = matrix.diagonal() > 0.0  # vertices of no tetrahedron stay where they are
        for coordinate in range(3):
            free = ~self._problem.conditions.held[:, coordinate] & used
            inner = matrix[free][:, free]
            load = (loads[:, coordinate] - matrix @ np.where(free, 0.0, values[:, coordinate]))[free]
            values[free, coordinate], status = cg(
                inner,
                load,
                x0=values[free, coordinate],
                rtol=_TOLERANCE,
                maxiter=_MOST_ITERATIONS,
                M=diags_array(1.0 / inner.diagonal()),
            )
            if status != 0:
                raise ReconstructionError("A map near the one that is compressed is too distorted to be rebuilt.")


def _through_exponential(slope: Floats, exponents: Floats, axes: Floats) -> Floats:
    """The derivative by H of what has the derivative ``slope`` by exp(H): divided differences in H's own axes."""
    half = 0.5 * (exponents[:, :, None] - exponents[:, None, :])
    middle = np.exp(0.5 * (exponents[:, :, None] + exponents[:, None, :]))
    small = np.abs(half) < _SMALL
    differences = middle * np.where(small, 1.0 + half**2 / 6.0, np.sinh(half) / np.where(small, 1.0, half))
    turned = axes.transpose(0, 2, 1) @ slope @ axes
    return np.asarray(axes @ (differences * turned) @ axes.transpose(0, 2, 1))
