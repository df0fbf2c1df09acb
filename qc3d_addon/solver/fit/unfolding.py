# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes folds locally: lowers an energy that is finite on folds, only around them, until none is left."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from ..arrays import Bools, Floats
from ..numerics.assembly import StiffnessPattern
from ..numerics.rotations import cofactors, determinants
from ..tets.mesh import TetMesh
from .energy_density import Terms, derivatives, energy_density, projected_blocks, regularized

# For each attempt: number of rings of tetrahedra around the folds that may move, and first width of the regularization.
_ATTEMPTS = ((1, 0.0), (2, 0.3), (3, 0.3), (4, 0.5), (6, 0.5))
_STEPS = 25
_NARROWEST, _SHARE = 1e-3, 0.1  # the width follows the worst determinant
_LEAST = 0.02  # determinants up to this count as folds when the neighborhood is chosen; up to half of it, as left
_BACKTRACKS = 10


def unfolded_nearby(mesh: TetMesh, values: Floats) -> Floats | None:
    """Values (N, 3) of a fold-free map that differs from a map with few folds only around these; None if not found.

    All tetrahedra have the same weight. Garanzha et al. 2021, *Foldover-free maps in 50 lines of code*, with Newton's
    method.

    Parameters
    ----------
    mesh : TetMesh
    values : (N, 3)
        Values of the map with folds. Coordinates that are fixed on the cube's faces do not change.
    """
    for rings, width in _ATTEMPTS:
        determinant = determinants(mesh.jacobians(values))
        if determinant.min() > 0.0:
            break
        values = _relaxed(mesh, values, determinant <= _LEAST, rings, width)
    return values if determinants(mesh.jacobians(values)).min() > 0.0 else None


def _relaxed(mesh: TetMesh, values: Floats, folded: Bools, rings: int, width: float) -> Floats:
    """The map after Newton steps of the vertices within ``rings`` rings of folded tetrahedra."""
    around = mesh.incidence
    moving = around @ folded > 0.0
    for _ in range(rings - 1):
        moving = around @ (around.T @ moving > 0.0) > 0.0
    tets = mesh.tets[around.T @ moving > 0.0]
    used, corners = np.unique(tets, return_inverse=True)
    part = TetMesh(mesh.points[used], corners.reshape(tets.shape))
    free = np.flatnonzero((moving[used, None] & ~mesh.on_cube_face[used]).ravel())
    pattern, ones = StiffnessPattern(part.tets, len(used)), np.ones(len(tets))
    moved, length = values[used], 1.0
    for number in range(_STEPS):
        jacobians = part.jacobians(moved)
        determinant = determinants(jacobians)
        if determinant.min() > 0.5 * _LEAST:
            break
        wanted = float(np.hypot(_NARROWEST, _SHARE * min(float(determinant.min()), 0.0)))
        width = max(wanted, width) if number == 0 else max(wanted, 0.5 * width) if width > wanted else 0.8 * width
        stand_in, first, second = regularized(determinant, width)
        squares, cofactor = np.einsum("mij,mij->m", jacobians, jacobians), cofactors(jacobians)
        terms = _chained(derivatives(squares, stand_in), first, second)
        stress = terms.linear[:, None, None] * jacobians + terms.slope[:, None, None] * cofactor
        gradient = part.divergence(stress).ravel()[free]
        blocks = projected_blocks(ones, part.gradients, jacobians, cofactor, squares, terms)
        matrix = csc_array(pattern.assemble_blocks(blocks).tocsr()[free][:, free])
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        step = np.zeros(moved.size)
        step[free] = -factors.solve(gradient)
        energy, slope = float(terms.density.sum()), float(gradient @ step[free])
        moved, length = _lowered(part, moved, step.reshape(-1, 3), width, energy, slope)
        if length == 0.0 and width <= _NARROWEST:
            break
    changed = values.copy()
    changed[used] = moved
    return changed


def _chained(terms: Terms, first: Floats, second: Floats) -> Terms:
    """Derivatives with respect to determinants, from those with respect to regularized ones, by the chain rule."""
    curvature = terms.curvature * first**2 + terms.slope * second
    return Terms(terms.density, terms.linear, terms.slope * first, terms.mixed * first, curvature)


def _lowered(
    part: TetMesh, values: Floats, step: Floats, width: float, energy: float, slope: float
) -> tuple[Floats, float]:
    """The map after the longest of the steps 1, 1/2, 1/4, ... that lowers the energy enough, and that length."""
    length = 1.0
    for _ in range(_BACKTRACKS):
        moved = values + length * step
        jacobians = part.jacobians(moved)
        stand_in = regularized(determinants(jacobians), width)[0]
        squares = np.einsum("mij,mij->m", jacobians, jacobians)
        if energy_density(squares, stand_in).sum() <= energy + 1e-4 * length * slope:
            return moved, length
        length *= 0.5
    return values, 0.0
