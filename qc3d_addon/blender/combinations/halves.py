# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of an object completed by its Mirror modifiers; vertices on the mirror plane stay on it."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ...solver.arrays import Floats
from ..kinds import mesh_of
from ..store.mesh_data import polygons, triangles, wire_edges
from ..store.mirror_modifiers import mirror_planes


class MirroredShapes:
    """Shapes of an object's mesh, with their mirror images if it has Mirror modifiers.

    Parameters
    ----------
    obj
    shapes : sequence of (n, 3)

    Attributes
    ----------
    shapes : tuple of (w, 3)
        Shapes of the whole, starting with the mesh's own vertices.
    faces, edges : (m, 3), (e, 2)
        Triangles of the whole, and its edges without a triangle.
    """

    def __init__(self, obj: bpy.types.Object, shapes: Sequence[Floats]) -> None:
        from ...solver.keys.halves import Whole  # scipy would make Blender start slower

        mesh = mesh_of(obj)
        self._count = len(shapes[0])
        planes = mirror_planes(obj)
        self._seams = [
            (plane, np.all([np.abs(plane.heights(shape)) <= plane.reach for shape in shapes], axis=0))
            for plane in planes
        ]
        faces, edges, owners = (part.astype(np.int64) for part in (triangles(mesh), wire_edges(mesh), polygons(mesh)))
        whole = Whole(tuple(shapes), faces, edges, owners)
        for plane in planes:
            whole = whole.mirrored(plane)
        self.shapes, self.faces, self.edges = whole.shapes, whole.faces, whole.edges

    def own(self, shape: Floats) -> Floats:
        """(n, 3) the mesh's own part of a shape (w, 3) of the whole, with its seam on the planes."""
        half = shape[: self._count]
        for plane, on_plane in self._seams:
            half = plane.raised(half, np.where(on_plane, -plane.heights(half), 0.0))
        return half
