# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Piecewise linear maps of tetrahedral meshes, of the cube or of any other domain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..errors import InputError
from ..keys.checks import LARGEST
from ..numerics.rotations import determinants
from ..tets.mesh import TetMesh, edge_matrices
from .representation import polar_decomposition

# Of the longest edge cubed: a tetrahedron with a smaller volume is flat up to rounding.
_FLAT = 1e-14


@dataclass(frozen=True, eq=False)
class Mapping:
    """A piecewise linear map, given by the images of the vertices of a tetrahedral mesh.

    Parameters
    ----------
    mesh : TetMesh
        The domain.
    values : (N, 3)
        Images of the vertices.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> mapping = Mapping.checked(corners, [[0, 1, 2, 3]], 2 * corners)
    >>> mapping.stretch[0].diagonal(), mapping.folds
    (array([2., 2., 2.]), 0)
    """

    mesh: TetMesh
    values: Floats

    @classmethod
    def checked(cls, points: ArrayLike, tets: ArrayLike, values: ArrayLike) -> Mapping:
        """Validate arrays of any origin and make a map of them.

        Parameters
        ----------
        points, values : (N, 3)
            Vertices and their images, in any unit.
        tets : (M, 4) int
            Vertex indices of the tetrahedra, in either orientation.

        Raises
        ------
        InputError
            If shapes disagree, a coordinate is not finite, an index is out of range, or a tetrahedron is flat.
        """
        mesh = checked_mesh(points, tets)
        images = _coordinates(values, "images of the vertices")
        if images.shape != mesh.points.shape:
            raise InputError(f"The map has {len(images)} images for {len(mesh.points)} vertices; one each is needed.")
        return cls(mesh, images)

    @cached_property
    def jacobians(self) -> Floats:
        """(M, 3, 3) Jacobian of the map on each tetrahedron."""
        return self.mesh.jacobians(self.values)

    @cached_property
    def stretch(self) -> Floats:
        """(M, 3, 3) symmetric stretches P in J = R P: the map's representation (Chen & Lui, section 5.1)."""
        return polar_decomposition(self.jacobians).stretch

    @property
    def folds(self) -> int:
        """Number of tetrahedra that the map inverts or flattens."""
        return int((determinants(self.jacobians) <= 0.0).sum())


def checked_mesh(points: ArrayLike, tets: ArrayLike) -> TetMesh:
    """Validate arrays of any origin and make a mesh of them in which every tetrahedron is positively oriented.

    Parameters
    ----------
    points : (N, 3)
        Vertices, in any unit.
    tets : (M, 4) int
        Vertex indices of the tetrahedra, in either orientation.

    Raises
    ------
    InputError
        If shapes disagree, a coordinate is not finite, an index is out of range, or a tetrahedron is flat.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> checked_mesh(corners, [[0, 2, 1, 3]]).tets  # given the other way round
    array([[0, 1, 2, 3]])
    """
    vertices = _coordinates(points, "vertices")
    corners = np.asarray(tets)
    if corners.dtype.kind not in "iu" or corners.ndim != 2 or corners.shape[1] != 4 or not len(corners):
        raise InputError("The mesh has no tetrahedra; a list of four whole numbers each is needed.")
    if corners.min() < 0 or corners.max() >= len(vertices):
        raise InputError(f"A tetrahedron has a corner that is no vertex; there are {len(vertices)} vertices, from 0.")
    corners = corners.astype(np.int64)
    edges = edge_matrices(vertices, corners)
    with np.errstate(divide="ignore", invalid="ignore"):  # flat ones are found below
        volumes = np.linalg.det(edges)
    longest = np.linalg.norm(edges, axis=1).max(axis=1)
    flat = np.flatnonzero(~(np.abs(volumes) > _FLAT * longest**3))
    if flat.size:
        raise InputError(
            f"{flat.size} tetrahedra of the mesh are flat, first number {flat[0]}; mesh the domain again without them."
        )
    backward = volumes < 0.0
    corners[backward] = corners[backward][:, [0, 2, 1, 3]]
    return TetMesh(vertices, corners)


def _coordinates(values: ArrayLike, what: str) -> Floats:
    given = np.asarray(values)
    if given.dtype.kind not in "fiu":
        raise InputError(f"The {what} must be numbers; three for each.")
    found = given.astype(np.float64)
    if found.ndim != 2 or found.shape[1] != 3:
        raise InputError(f"The {what} have the shape {found.shape}; (N, 3) is needed.")
    if not np.isfinite(found).all():
        raise InputError(f"The {what} hold numbers that are not finite; correct them first.")
    if np.abs(found).max(initial=0.0) > LARGEST:
        raise InputError(f"The {what} have coordinates beyond {LARGEST:.0e}; scale the mesh to below that.")
    return found
