# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The volume around the first key of a pair, with all that follows from it, whatever the second key is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, diags_array

from ..arrays import Floats, Ints
from ..collision.crossings import CrossingSearch
from ..keys.embedding import ROOM, Cube, Embedding
from ..maps.volume_system import VolumeSystem
from ..meshing.cube import fill_cube
from ..settings import FitOptions
from ..tets.mesh import TetMesh
from ..tets.point_location import interpolation_matrix
from ..triangles.winding_number import insideness, winding_numbers
from .lattice import mesh_on_lattice
from .stiff_landmarks import StiffFitter

# Landmarks pull so hard that what is missed is what the tetrahedra cannot follow; more only makes some of them thin.
_LANDMARK_SHARE = 30.0


@dataclass(frozen=True, eq=False)
class Volume:
    """The filled cube around a key. Several pairs of keys share it if they have the same first key in the same cube.

    Parameters
    ----------
    mesh : TetMesh
        The filled unit cube.
    engine : str
        The engine that made the mesh; the option ``auto`` leaves it open.
    key0 : (n, 3)
        The first key, cube units.
    faces : (m, 3) int64
        Its triangles.
    weights : (n,)
        Positive weights of its vertices, with the sum 1.
    notes : tuple of str
        Sentences for the user, such as why another engine was used.
    cube : Cube, optional
        Where the cube stands, if it is not that of a single pair.
    search : CrossingSearch, optional
        Finds crossings of the first key's triangles, welded as it is itself, if several pairs share it.
    """

    mesh: TetMesh
    engine: str
    key0: Floats
    faces: Ints
    weights: Floats
    notes: tuple[str, ...] = ()
    cube: Cube | None = None
    search: CrossingSearch | None = None

    @classmethod
    def filled(cls, embedding: Embedding, options: FitOptions, cube: Cube | None = None) -> Volume:
        """Fill the cube around the first key of an embedded pair.

        The tetrahedra follow the motion to the second key, unless they serve other second keys too.

        Parameters
        ----------
        embedding : Embedding
        options : FitOptions
        cube : Cube, optional
            The cube of the embedding, if it is not that of this pair alone; the second key then makes no difference.

        Raises
        ------
        MeshingError
            If the chosen engine cannot fill it.
        """
        key0, key1, faces = embedding.key0, embedding.key1, embedding.pair.faces
        points, moved = (key0, key1) if options.quality == "exact" else map(in_single_precision, (key0, key1))
        if cube is None:
            made = fill_cube(points, faces, options, moved)
        else:
            made = fill_cube(points, faces, options, size=1.0 / ROOM)
        return cls(mesh_on_lattice(made.mesh), made.engine, key0, faces, embedding.weights, made.notes, cube)

    @cached_property
    def landmarks(self) -> csr_array:
        """(n, N) barycentric coordinates of the first key's vertices in the mesh."""
        return interpolation_matrix(self.mesh, self.key0)

    @cached_property
    def insideness(self) -> Floats:
        """(M,) weight of each tetrahedron by its winding number: 1 inside the object, small outside."""
        return insideness(winding_numbers(self.key0, self.faces, self.mesh.centroids))

    @cached_property
    def system(self) -> VolumeSystem:
        """The linear system of maps of the mesh."""
        return VolumeSystem(self.mesh, self.insideness)

    @cached_property
    def around_landmarks(self) -> tuple[csr_array, csr_array]:
        """(n, N) and (N, M): averages of the tetrahedra around the mesh's vertices, taken to the first key's vertices.

        Tetrahedra inside the object count before all.
        """
        around = csr_array(self.mesh.incidence @ diags_array(self.mesh.volumes * self.insideness))
        totals = self.landmarks @ around.sum(axis=1)
        return csr_array(diags_array(1.0 / totals) @ self.landmarks), around

    @cached_property
    def fitter(self) -> StiffFitter:
        """Fits maps of the mesh to second keys; each fit needs its own, made by ``anew``.

        A fit takes a few hundred steps, each of which makes differences grow. What differs by rounding only, such as
        keys that were moved, must lead to the same map: hence single precision.
        """
        rounded = in_single_precision(self.key0)
        weights, inside = in_single_precision(_LANDMARK_SHARE * self.weights), in_single_precision(self.insideness)
        return StiffFitter(self.mesh, interpolation_matrix(self.mesh, rounded), weights, inside)


def in_single_precision(values: Floats) -> Floats:
    """Values rounded to single precision."""
    return np.asarray(values, dtype=np.float32).astype(np.float64)
