# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's modifier Corrective Smooth over the straight blend, with its default settings, evaluated by Blender.

The modifier stores how the first key differs from its own smoothed shape, and puts these differences back onto the
smoothed blend, turned along with it. Its rest shape is the first key, which is met; the second is not. So the same is
done from the second key, and both are blended with the weights 1 - t and t.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .gradients import Floats, Ints


def frames(key0: Floats, key1: Floats, faces: Ints, times: ArrayLike) -> Floats:
    """In-betweens (k, n, 3) at the times; needs Blender's Python module."""
    moments = np.asarray(times, dtype=np.float64)[:, None, None]
    forward = _smoothed(key0, key1, faces, moments[:, 0, 0])
    backward = _smoothed(key1, key0, faces, 1.0 - moments[:, 0, 0])
    return np.asarray((1.0 - moments) * forward + moments * backward)


def _smoothed(rest: Floats, other: Floats, faces: Ints, values: Floats) -> Floats:
    import bpy

    from qc3d_addon.blender.kinds import mesh_of, present

    mesh = bpy.data.meshes.new("rest")
    mesh.from_pydata(rest.tolist(), [], faces.tolist())
    obj = bpy.data.objects.new("rest", mesh)
    present(bpy.context.scene).collection.objects.link(obj)
    try:
        obj.shape_key_add(name="Basis", from_mix=False)
        key = obj.shape_key_add(name="other", from_mix=False)
        key.points.foreach_set("co", np.ascontiguousarray(other, dtype=np.float32).ravel())
        obj.modifiers.new("smooth", "CORRECTIVE_SMOOTH")
        made = []
        for value in values.tolist():
            key.value = value
            evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
            places = np.empty(3 * len(rest), dtype=np.float32)
            mesh_of(evaluated).vertices.foreach_get("co", places)
            made.append(places.reshape(-1, 3).astype(np.float64))
        return np.stack(made)
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)
