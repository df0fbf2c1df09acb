# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror planes of an object's Mirror modifiers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...solver.errors import InputError

if TYPE_CHECKING:
    from ...solver.keys.halves import MirrorPlane

# Relative to the size: tolerance for vertices on the plane if the modifier does not merge.
_ON_PLANE = 1e-6


def mirror_planes(obj: bpy.types.Object) -> tuple[MirrorPlane, ...]:
    """The planes of the Mirror modifiers that the viewport shows, in the object's own space, in their order.

    Bisected axes are left out: the modifier cuts off the other side, so the mesh itself has more than one half.

    Raises
    ------
    InputError
        If an object has the scale 0 along an axis, so that it has no mirror plane.
    """
    planes = []
    for modifier in obj.modifiers:
        if isinstance(modifier, bpy.types.MirrorModifier) and modifier.show_viewport:
            axes: tuple[Any, Any] = (modifier.use_axis, modifier.use_bisect_axis)  # no arrays to read in 5.2's stubs
            chosen = zip(*axes, strict=True)
            for axis, (is_mirrored, is_bisected) in enumerate(chosen):
                if is_mirrored and not is_bisected:
                    planes.append(_plane(obj, modifier, axis))
    return tuple(planes)


def _plane(obj: bpy.types.Object, modifier: bpy.types.MirrorModifier, axis: int) -> MirrorPlane:
    from ...solver.keys.halves import MirrorPlane

    # A vertex is merged with its image if their distance, twice that from the plane, is below the threshold.
    reach = 0.5 * modifier.merge_threshold if modifier.use_mirror_merge else _ON_PLANE * max(obj.dimensions[:])
    if modifier.mirror_object is None:
        return MirrorPlane.across(axis, reach)
    own, other = (np.array(shown.matrix_world, dtype=np.float64) for shown in (obj, modifier.mirror_object))
    try:
        seen = np.linalg.inv(own) @ other
        normal = np.linalg.inv(seen)[axis, :3]
    except np.linalg.LinAlgError as error:
        raise InputError(
            f"'{obj.name}' or its mirror object '{modifier.mirror_object.name}' has the scale 0 along an axis, so "
            f"'{modifier.name}' cannot mirror it; set another scale."
        ) from error
    # Scale the normal so that its dot product measures distances along the mirror direction.
    length = float(np.linalg.norm(seen[:3, axis]))
    normal, direction = normal * length, seen[:3, axis] / length
    return MirrorPlane(tuple(normal.tolist()), tuple(direction.tolist()), float(normal @ seen[:3, 3]), reach)
