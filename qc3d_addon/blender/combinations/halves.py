# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of an object completed by its Mirror modifiers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...solver.arrays import Floats
from ..kinds import mesh_of
from ..store.mesh_data import polygons, triangles, wire_edges
from ..store.mirror_modifiers import mirror_planes

if TYPE_CHECKING:
    from ...solver.combinations.mirrored import MirroredShapes


def completed(obj: bpy.types.Object, shapes: Sequence[Floats]) -> MirroredShapes:
    """Shapes (n, 3) of an object's mesh, with their mirror images if it has Mirror modifiers."""
    from ...solver.combinations.mirrored import MirroredShapes  # scipy would make Blender start slower

    mesh = mesh_of(obj)
    faces, edges, owners = (part.astype(np.int64) for part in (triangles(mesh), wire_edges(mesh), polygons(mesh)))
    return MirroredShapes(shapes, faces, edges, owners, mirror_planes(obj, shapes))
