# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth functions on a tetrahedral mesh, the lowest frequencies first, and values carried between tets and vertices.

The eigenfunctions of the Laplacian, L phi = lambda M phi, with the stiffness matrix L of linear elements. M holds the
lumped vertex volumes (Chen & Lui, section 7), or the same weight for every vertex: since the mesh is finest where the
shape is, low modes of the second kind have their detail there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import eigsh

from ..arrays import Floats
from ..errors import InputError
from ..numerics.assembly import StiffnessPattern, stiffness_elements
from ..numerics.grouped_sums import sums_by_label
from ..tets.mesh import TetMesh

# A shift below the eigenvalue 0, in units of the domain's own lowest frequencies.
_SHIFT = -0.1
_SEED = 20230805

Weights = Literal["volume", "equal"]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The lowest modes of a mesh.

    Parameters
    ----------
    eigenvalues : (k,)
        Ascending; the first is 0 for a mesh in one piece. One over a length squared.
    modes : (N, k)
        Values at the vertices, orthonormal with the vertices' weights, which sum to the mesh's volume.
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
        If the mesh has too few vertices for so many modes.
    """
    most = len(mesh.points) - 2
    if not 1 <= count <= most:
        raise InputError(f"{count} modes are not possible on {len(mesh.points)} vertices; choose 1 to {most}.")
    stiffness = StiffnessPattern(mesh.tets, len(mesh.points)).assemble(
        stiffness_elements(mesh.volumes, mesh.gradients)
    )
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    mass = Transfer(mesh).vertex_volumes
    if weights == "equal":
        mass = np.full(len(mass), mass.mean())
    # With the square root of the mass on both sides the problem is an ordinary symmetric one.
    scale = 1.0 / np.sqrt(np.maximum(mass, 1e-300))
    matrix = csc_array(diags_array(scale) @ stiffness @ diags_array(scale))
    start = np.random.default_rng(_SEED).normal(size=len(mesh.points))
    values, vectors = eigsh(matrix, k=count, sigma=_SHIFT / size**2, v0=start)
    order = np.argsort(values, kind="stable")
    modes = scale[:, None] * vectors[:, order]
    # A mode and its opposite are equally right: the same one is taken whatever the solver returns.
    signs = np.where(start @ (modes / scale[:, None]) < 0.0, -1.0, 1.0)
    return Spectrum(np.maximum(values[order], 0.0), modes * signs)
