# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects as Blender evaluates them, including hidden ones, which it otherwise leaves as they were when they were seen
last: at the origin, without modifiers, after a file was opened.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np

from ...solver.arrays import Floats
from ..kinds import present


@contextmanager
def evaluated(objects: Sequence[bpy.types.Object]) -> Iterator[bpy.types.Depsgraph]:
    """A dependency graph with all these objects, whether they are shown or not; they are only valid inside the block.

    A temporary object depends on those that are not shown, so that Blender evaluates them too.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    left_out = [obj for obj in dict.fromkeys(objects) if not obj.evaluated_get(depsgraph).is_evaluated]
    if not left_out:
        yield depsgraph
        return
    observer = bpy.data.objects.new("QC3D", None)
    try:
        for obj in left_out:
            # The first depends on the place of an object, the second on the shape of a mesh.
            for kind in ('COPY_TRANSFORMS', *(('SHRINKWRAP',) if obj.type == 'MESH' else ())):
                constraint: object = observer.constraints.new(kind)
                setattr(constraint, "target", obj)  # noqa: B010 - which constraints have one, no type tells
        present(bpy.context.scene).collection.objects.link(observer)
        yield bpy.context.evaluated_depsgraph_get()
    finally:
        bpy.data.objects.remove(observer)


def world_matrices(objects: Sequence[bpy.types.Object]) -> list[Floats]:
    """(4, 4) transform of each object to the world, at the current frame."""
    with evaluated(objects) as depsgraph:
        return [np.array(obj.evaluated_get(depsgraph).matrix_world, dtype=np.float64) for obj in objects]
