# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth functions on a tetrahedral mesh, the lowest frequencies first, and values carried between tets and vertices.

The eigenfunctions of the Laplacian, L phi = lambda M phi, with the stiffness matrix L of linear elements. M holds the
lumped vertex volumes (Chen & Lui, section 6.2), or the same weight for every vertex: since the mesh is finest where the
shape is, low modes of the second kind have their detail there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import eigsh

from ..arrays import Floats
from ..errors import InputError
from ..numerics.assembly import gradient_operator
from ..numerics.grouped_sums import sums_by_label
from ..numerics.lowest_eigenvectors import BLOCK, GUARDS, EigenPairs, coarse_eigenvectors, lowest_eigenvectors
from ..numerics.multigrid import Multigrid
from ..support.memory import require_memory_for_modes
from ..tets.mesh import TetMesh

# A shift below the eigenvalue 0, in units of the domain's own lowest frequencies.
_SHIFT = -0.1
_SEED = 20230805
# Matrices of so few vertices are factored: that takes a second or two. It also is for so many modes that multigrid's
# second mesh, which has about a thirtieth of the vertices, does not have them.
_FEW, _PER_MODE = 10_000, 100
_DENSE, _DENSE_MATRICES = 4, 3  # more than a quarter of all modes come from a dense matrix; it is held so many times
_TOLERANCE = 1e-8  # of the residuals, over the largest eigenvalue asked for

Weights = Literal["volume", "equal"]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The lowest modes of a mesh.

    Parameters
    ----------
    eigenvalues : (k,)
        Ascending; as many are 0 as the mesh has connected parts. One over a length squared.
    modes : (N, k)
        Values at the vertices, orthonormal with the vertices' weights, which sum to the mesh's volume; 0 at vertices
        of no tetrahedron.
    """

    eigenvalues: Floats
    modes: Floats


class Transfer:
    """Carries values between the tetrahedra and the vertices of a mesh.

    Parameters
    ----------
    mesh : TetMesh
    """

    def __init__(self, mesh: TetMesh) -> None:
        self._mesh = mesh

    @cached_property
    def vertex_volumes(self) -> Floats:
        """(N,) a quarter of the volume of the tetrahedra around each vertex."""
        mesh = self._mesh
        weights = np.repeat(mesh.volumes / 4.0, 4)
        return sums_by_label(mesh.tets.ravel(), weights, len(mesh.points))

    @cached_property
    def to_vertices(self) -> csr_array:
        """(N, M) mean over the tetrahedra around each vertex, weighted by volume."""
        mesh = self._mesh
        shares = mesh.incidence @ diags_array(mesh.volumes / 4.0)
        return csr_array(diags_array(1.0 / np.maximum(self.vertex_volumes, 1e-300)) @ shares)

    @cached_property
    def to_tets(self) -> csr_array:
        """(M, N) mean of the four corners."""
        mesh = self._mesh
        starts = np.arange(0, 4 * len(mesh.tets) + 1, 4)
        quarters = np.full(mesh.tets.size, 0.25)
        return csr_array((quarters, mesh.tets.ravel(), starts), (len(mesh.tets), len(mesh.points)))


def spectrum(mesh: TetMesh, count: int, weights: Weights = "volume") -> Spectrum:
    """The lowest ``count`` modes; the same on every call.

    On another machine they are the same up to rounding, unless a symmetry of the mesh makes two eigenvalues equal.

    Parameters
    ----------
    mesh : TetMesh
    count : int
    weights : Weights
        What a vertex weighs: ``volume`` as published, or ``equal``.

    Raises
    ------
    InputError
        If the mesh has too few vertices for so many modes, or needs more memory for them than there is.
    """
    used = np.unique(mesh.tets)
    if not 1 <= count <= len(used):
        raise InputError(f"{count} modes are not possible on {len(used)} vertices; choose 1 to {len(used)}.")
    is_dense = _DENSE * count > len(used)
    is_factored = len(used) <= _FEW or count * _PER_MODE > len(used)
    block = 0 if is_factored else min(BLOCK, count + GUARDS)
    require_memory_for_modes(len(used), _DENSE_MATRICES * len(used) if is_dense else count, block)
    gradient = gradient_operator(mesh.tets, mesh.gradients, len(mesh.points))
    stiffness = csr_array(gradient.T @ (diags_array(np.tile(mesh.volumes, 3)) @ gradient))
    del gradient
    size = float(np.linalg.norm(np.ptp(mesh.points[used], axis=0)))
    mass = Transfer(mesh).vertex_volumes[used]
    if weights == "equal":
        mass = np.full(len(mass), mass.mean())
    # With the square root of the mass on both sides the problem is an ordinary symmetric one.
    scale = 1.0 / np.sqrt(mass)
    matrix = csr_array(diags_array(scale) @ stiffness[used][:, used] @ diags_array(scale))
    start = np.random.default_rng(_SEED).normal(size=len(used))
    shift = _SHIFT / size**2
    if is_dense:
        values, vectors = eigh(matrix.toarray(), subset_by_index=(0, count - 1), overwrite_a=True)
    elif is_factored:
        values, vectors = _factored(matrix, count, shift, start)
    else:
        values, vectors = _iterated(matrix, count, shift, scale)
    # A mode and its opposite are equally right: the same one is taken whatever the solver returns.
    signs = np.where(start @ vectors < 0.0, -1.0, 1.0)
    modes = np.zeros((len(mesh.points), count))
    modes[used] = scale[:, None] * vectors * signs
    return Spectrum(np.maximum(values, 0.0), modes)


def _factored(matrix: csr_array, count: int, shift: float, start: Floats) -> EigenPairs:
    """By Lanczos' method on the inverse of the shifted matrix."""
    values, vectors = eigsh(csc_array(matrix), k=count, sigma=shift, v0=start)
    order = np.argsort(values, kind="stable")
    return EigenPairs(values[order], vectors[:, order])


def _iterated(matrix: csr_array, count: int, shift: float, scale: Floats) -> EigenPairs:
    """Preconditioned by multigrid, for which the shifted matrix is positive definite; nothing large is factored."""
    shifted = csr_array(matrix - shift * eye_array(len(scale)))
    multigrid = Multigrid(shifted, 1.0 / scale, np.random.default_rng(_SEED))
    assert multigrid.interpolation is not None
    start = coarse_eigenvectors(matrix, multigrid.interpolation, count + GUARDS)
    # The values of the approximations are above the true ones, by little at this end.
    highest = float(np.linalg.norm(start[:, count - 1] @ (matrix @ start[:, count - 1])))
    return lowest_eigenvectors(matrix, multigrid.approximate_solution, start, count, _TOLERANCE * highest)
