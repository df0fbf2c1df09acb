# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fill the unit cube around a surface with tetrahedra: two engines behind one function."""

from __future__ import annotations

from dataclasses import dataclass

from .delaunay import delaunay_mesh
from .errors import MeshingError
from .sampling import RESOLUTIONS
from .settings import Settings
from .tetmesh import Floats, Ints, TetMesh


@dataclass(frozen=True, eq=False)
class FilledCube:
    """A tetrahedral mesh of the unit cube and how it came about.

    Parameters
    ----------
    mesh : TetMesh
        Conforming, positively oriented, total volume 1; coordinates on the cube's faces are exactly 0 or 1.
    engine : str
        The engine that made it: ``tetwild`` or ``delaunay``.
    notes : tuple of str
        Sentences for the user, such as why the preferred engine was not used.
    """

    mesh: TetMesh
    engine: str
    notes: tuple[str, ...]


def engine_available(name: str) -> bool:
    """Whether the engine can run here; cheap, loads nothing."""
    return name in ("auto", "delaunay")


def fill_cube(points: Floats, faces: Ints, settings: Settings) -> FilledCube:
    """Fill the unit cube with tetrahedra, finest near a surface.

    The surface's vertices do not become vertices of the mesh: the resolution follows ``settings.quality``, not the
    vertex count. Find the vertices in the mesh with :mod:`.location`.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices in the cube, away from its faces (0.1 or more).
    faces : (m, 3) int64
        Triangles: open, non-manifold, crossing, degenerate or none at all.
    settings : Settings

    Raises
    ------
    MeshingError
        If the chosen engine cannot run or fails; with ``auto`` the second engine steps in and a note says so.
    """
    resolution = RESOLUTIONS[settings.quality]
    if settings.engine == "tetwild":
        raise MeshingError("The meshing engine tetwild is not installed; choose the engine delaunay or auto.")
    return FilledCube(delaunay_mesh(points, faces, resolution, settings.seed), "delaunay", ())
