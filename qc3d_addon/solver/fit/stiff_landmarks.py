# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fold-free maps with landmark weights that are so large that the landmarks are met.

Three things make this possible. Tetrahedra have the same weight, whatever their volumes: then small ones, as around
fingers, move nearly rigidly, and large ones yield (Stein, Tezduyar & Benney 2003, *Mesh moving techniques for
fluid-structure interactions with large displacements*). With volumes as weights, small tetrahedra beside a part that
moves far are squashed at once, and hold up all others. Conjugate gradients are preconditioned by a factored matrix that
contains the landmarks' weights, so that larger weights need no more iterations. And if a few tetrahedra would fold, the
step is shortened only around them.
"""

from __future__ import annotations

import copy

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import SuperLU

from ..arrays import Bools, Floats
from ..numerics.conjugate_gradients import conjugate_gradients
from ..numerics.nested_dissection import elimination_order, factored
from ..numerics.rotations import determinants
from ..tets.mesh import TetMesh
from .fold_free import LANDMARK_WEIGHT, FoldFreeFitter, Misfit

_TOLERANCE = 0.06
_PRODUCTS = 5, 120  # smallest and largest number of iterations; fewer only solve the stiffest equations
_MANY_PRODUCTS = 25  # if a solve needs more, the preconditioner is computed again
_SETTLED = 3e-2  # relative to the energy above its minimum, the identity's 1
_HOLDING = 1e6  # how much stiffer than others what is held counts in the preconditioner
_HALVINGS = 9
_LEAST_LENGTH = 1e-3  # shorter steps end the iteration
_LEAST_LEFT = 0.25  # in one step, a determinant may shrink to this fraction
_GROWTH, _RINGS = 1.25, 24  # growth of the step length per ring around tetrahedra that limit it; number of rings


class StiffFitter(FoldFreeFitter):
    """Fits maps of one mesh to landmarks with large weights.

    Parameters
    ----------
    mesh : TetMesh
    landmarks : (n, N) sparse array
    weights : (n,)
    insideness : (M,), optional
        How far inside an object each tetrahedron is, from 0 to 1. Inside, weights are as the volumes then, so that an
        object that grows does so evenly; outside, they are all the same.
    held : (N,) bool, optional
        Vertices that do not move, beside what the cube's faces hold.
    """

    def __init__(
        self,
        mesh: TetMesh,
        landmarks: csr_array,
        weights: Floats,
        insideness: Floats | None = None,
        held: Bools | None = None,
    ) -> None:
        super().__init__(mesh, landmarks, weights)
        self._held = np.zeros(len(mesh.points), dtype=bool) if held is None else held
        self._free &= ~self._held[:, None]
        inside = np.zeros(len(mesh.tets)) if insideness is None else insideness
        volumes = inside * mesh.volumes
        by_volume = volumes * (inside.sum() / max(float(volumes.sum()), np.finfo(np.float64).tiny))
        self._tet_weights = (by_volume + 1.0 - inside) / len(mesh.tets)
        pattern = self._pattern.assemble(np.ones((len(mesh.tets), 4, 4)))
        self._order = elimination_order(mesh.points, pattern)
        self._rank = np.argsort(self._order)
        corners = mesh.tets.ravel()
        self._by_vertex = np.argsort(corners, kind="stable")
        self._starts = np.searchsorted(corners[self._by_vertex], np.arange(len(mesh.points)))
        self._forget_factors()

    def with_weights(self, weights: Floats) -> StiffFitter:
        """A fitter of the same mesh to the same landmarks with other weights (n,)."""
        other = self.anew()
        other._weights = weights
        other._landmark_matrix = csr_array(self.landmarks.T @ diags_array(weights) @ self.landmarks)
        other._landmark_blocks = other._blocks_of(other._landmark_matrix)
        return other

    def anew(self) -> StiffFitter:
        """A fitter of the same mesh to the same landmarks: factors are kept from step to step, but not between fits."""
        other = copy.copy(self)
        other._forget_factors()
        return other

    def _forget_factors(self) -> None:
        self._factors: SuperLU | None = None

    def _settled(self, decrease: float, energy: float) -> bool:
        return decrease < _SETTLED * (energy - 1.0)

    def _newton_step(self, gradient: Floats, element_blocks: Floats) -> Floats:
        matrix = self._pattern.assemble_blocks(element_blocks)
        if self._factors is None:
            scalar = self._pattern.assemble(np.trace(element_blocks, axis1=3, axis2=4) / 3.0)
            holding = _HOLDING * float(scalar.diagonal().max()) * self._held
            scalar = csr_array(scalar + LANDMARK_WEIGHT * self._landmark_matrix + diags_array(holding))
            self._factors = factored(csr_array(scalar[self._order][:, self._order]))
        factors = self._factors
        matrix.data += LANDMARK_WEIGHT * self._landmark_blocks
        free = self._free.ravel()

        def precondition(vector: Floats) -> Floats:
            loads = (vector * free).reshape(-1, 3)[self._order]
            return np.asarray(factors.solve(loads)[self._rank].ravel() * free)

        def multiply(vector: Floats) -> Floats:
            return np.asarray(matrix @ (vector * free) * free)

        load = -gradient.ravel()
        step, products = conjugate_gradients(multiply, precondition, load, _TOLERANCE, _PRODUCTS)
        if products > _MANY_PRODUCTS:
            self._factors = None
        return step.reshape(-1, 3)

    def _line_search(
        self, values: Floats, step: Floats, energy: float, slope: float, misfit: Misfit
    ) -> tuple[float, Floats]:
        length, moved = super()._line_search(values, step, energy, slope, misfit)
        if length >= 0.5:
            return length, moved
        held_back = values + self._lengths(values, step)[:, None] * step
        reached = self._energy(held_back, misfit)
        if reached < (energy if length == 0.0 else self._energy(moved, misfit)):
            return 0.5, held_back
        return (length, moved) if length >= _LEAST_LENGTH else (0.0, values)

    def _lengths(self, values: Floats, step: Floats) -> Floats:
        """(N,) step length of each vertex: short around tetrahedra that would fold, and growing away from them."""
        at, change = self.mesh.jacobians(values), self.mesh.jacobians(step)
        least = _LEAST_LEFT * determinants(at)
        of_tets = np.ones(len(least))
        folding, length = np.arange(len(least)), 1.0
        for _ in range(_HALVINGS):
            folding = folding[determinants(at[folding] + length * change[folding]) < least[folding]]
            if not len(folding):
                break
            length *= 0.5
            of_tets[folding] = length
        tets, owners = self.mesh.tets, self._by_vertex // 4
        of_vertices = np.minimum.reduceat(of_tets[owners], self._starts)
        for _ in range(_RINGS):
            around = of_vertices[tets].min(axis=1)
            shorter = np.minimum(of_vertices, _GROWTH * np.minimum.reduceat(around[owners], self._starts))
            if np.array_equal(shorter, of_vertices):
                break
            of_vertices = shorter
        return np.asarray(of_vertices)
