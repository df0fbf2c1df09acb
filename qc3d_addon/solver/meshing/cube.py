# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the unit cube with tetrahedra around a surface: two engines behind one function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from ..errors import MeshingError
from ..settings import FitOptions
from ..tets.mesh import TetMesh
from .delaunay import delaunay_mesh
from .poisson_disk import RESOLUTIONS
from .tetwild import MARGIN, tetwild_mesh
from .tetwild_loading import unavailable_reason
from .vertex_mesh import vertex_mesh

# As a fraction of the cube's volume. A tetrahedron with edges of 0.01 and this volume is flat up to rounding.
SMALLEST_VOLUME = 1e-14


@dataclass(frozen=True, eq=False)
class FilledCube:
    """A tetrahedral mesh of the unit cube, and how it was made.

    Parameters
    ----------
    mesh : TetMesh
        Conforming, positively oriented, with total volume 1; coordinates on the cube's faces are exactly 0 or 1.
    engine : str
        The engine that made it: ``tetwild`` or ``delaunay``.
    notes : tuple of str
        Sentences for the user, such as why the preferred engine was not used.
    """

    mesh: TetMesh
    engine: str
    notes: tuple[str, ...]


def fill_cube(
    points: Floats, faces: Ints, options: FitOptions, moved: Floats | None = None, size: float = 1.0
) -> FilledCube:
    """Fill the unit cube with tetrahedra, finest near a surface.

    The surface's vertices do not become vertices of the mesh: its resolution depends on ``options.quality``, not on
    the number of vertices. Find the surface in the mesh with :mod:`~qc3d_addon.solver.tets.point_location`.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices inside [0.14, 0.86]³.
    faces : (m, 3) int64
        Triangles; they may be open, non-manifold, crossing or degenerate, and there may be none.
    options : FitOptions
        Its quality, engine, seed and time limit.
    moved : (n, 3), optional
        The vertices of the second key, in the same cube. The engine delaunay is finer where the motion asks for it.
    size : float
        Size of the surface, beside its size where it fills the cube: samples on it are as many, and so much closer.
        Without effect on the quality ``exact``, which follows the vertices.

    Raises
    ------
    MeshingError
        If the input is unusable, or if the chosen engine is unavailable or fails. With the engine ``auto``, delaunay
        takes over from tetwild instead, and a note says so.
    """
    points, faces = np.asarray(points, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    _require_usable(points, faces)
    if options.quality == "exact":
        mesh = vertex_mesh(points, faces, options.seed, moved)
        require_filled_cube(mesh)
        return FilledCube(mesh, "delaunay", ())
    resolution = RESOLUTIONS[options.quality].scaled(size).beside(points, faces)
    notes: list[str] = []
    if options.engine != "delaunay":
        try:
            mesh = tetwild_mesh(points, faces, resolution, options.seed, options.mesh_time_limit)
            require_filled_cube(mesh)
            return FilledCube(mesh, "tetwild", ())
        except MeshingError as error:
            if options.engine == "tetwild" and unavailable_reason() is not None:
                raise MeshingError(f"{error} Choose the engine delaunay or auto.") from error
            if options.engine == "tetwild":
                raise
            notes.append(f"The cube was filled by the engine delaunay. {error}")
    mesh = delaunay_mesh(points, faces, resolution, options, moved)
    require_filled_cube(mesh)
    return FilledCube(mesh, "delaunay", tuple(notes))


def require_filled_cube(mesh: TetMesh) -> None:
    """Check that a mesh is a conforming partition of the unit cube into positively oriented tetrahedra.

    Raises
    ------
    MeshingError
        If a vertex is not finite or belongs to no tetrahedron, a tetrahedron is flat or inverted, faces do not match,
        the boundary is not exactly on the cube's faces, or the volumes do not sum to 1.
    """
    problem = None
    if not np.isfinite(mesh.points).all():
        problem = "has vertices that are not finite"
    elif not np.isin(np.arange(len(mesh.points)), mesh.tets).all():
        problem = "has vertices that belong to no tetrahedron"
    elif not (mesh.volumes > SMALLEST_VOLUME).all():
        problem = f"has {np.count_nonzero(mesh.volumes <= SMALLEST_VOLUME)} flat or inverted tetrahedra"
    elif not mesh.on_cube_face[mesh.boundary_faces].all(axis=1).any(axis=1).all():
        problem = "has boundary faces that do not lie on the cube"
    elif abs(float(mesh.volumes.sum()) - 1.0) > 1e-12:
        problem = f"misses the cube's volume by {abs(float(mesh.volumes.sum()) - 1.0):.1e}"
    if problem:
        raise MeshingError(f"The tetrahedral mesh {problem}; try another quality, seed or engine.")


def _require_usable(points: Floats, faces: Ints) -> None:
    if not len(points):
        raise MeshingError("There is no vertex to fill the cube around.")
    # Tested as "inside", since a comparison with NaN is false.
    bad = np.flatnonzero(~((points >= MARGIN) & (points <= 1.0 - MARGIN)).all(axis=1))
    if bad.size:
        raise MeshingError(
            f"Vertex {bad[0]} at {points[bad[0]]} is not inside [{MARGIN}, {1.0 - MARGIN}]³, where the cube is filled."
        )
    if faces.size and (faces.min() < 0 or faces.max() >= len(points)):
        raise MeshingError(f"A triangle refers to a vertex outside 0..{len(points) - 1}.")
