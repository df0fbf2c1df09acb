# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror planes of an object's Mirror modifiers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from .evaluation import world_matrices

if TYPE_CHECKING:
    from ...solver.keys.halves import MirrorPlane

# Relative to the size: tolerance for vertices on the plane if the modifier does not merge.
_ON_PLANE = 1e-6


def mirror_planes(obj: bpy.types.Object, shapes: Sequence[NDArray[Any]]) -> tuple[MirrorPlane, ...]:
    """The planes of the Mirror modifiers that views or renders show, in the object's own space, in their order.

    On bisected axes the modifier cuts off what is on the other side. Such a plane is left out if some of the mesh is
    there: the mesh itself has more than one half.

    Parameters
    ----------
    obj
    shapes
        Shapes (n, 3) of the object's mesh.

    Raises
    ------
    InputError
        If an object has the scale 0 along an axis, so that it has no mirror plane.
    """
    size = max((float(np.ptp(shape, axis=0).max(initial=0.0)) for shape in shapes if len(shape)), default=0.0)
    planes = []
    for modifier, axis, is_bisected in mirrored_axes(obj):
        plane = _plane(obj, modifier, axis, size)
        if not is_bisected or _is_on_one_side(plane, shapes, max(plane.reach, modifier.bisect_threshold)):
            planes.append(plane)
    return tuple(planes)


def mirrored_axes(obj: bpy.types.Object) -> Iterator[tuple[bpy.types.MirrorModifier, int, bool]]:
    """Each Mirror modifier with each of its axes, and whether it cuts the mesh there."""
    for modifier in obj.modifiers:
        if isinstance(modifier, bpy.types.MirrorModifier) and (modifier.show_viewport or modifier.show_render):
            axes: tuple[Any, Any] = (modifier.use_axis, modifier.use_bisect_axis)  # no arrays to read in 5.2's stubs
            chosen = zip(*axes, strict=True)
            for axis, (is_mirrored, is_bisected) in enumerate(chosen):
                if is_mirrored:
                    yield modifier, axis, is_bisected


def _is_on_one_side(plane: MirrorPlane, shapes: Sequence[NDArray[Any]], slack: float) -> bool:
    heights = np.concatenate([plane.heights(shape) for shape in shapes])
    return bool(heights.min(initial=0.0) >= -slack or heights.max(initial=0.0) <= slack)


def _plane(obj: bpy.types.Object, modifier: bpy.types.MirrorModifier, axis: int, size: float) -> MirrorPlane:
    from ...solver.keys.halves import MirrorPlane

    # A vertex is merged with its image if their distance, twice that from the plane, is below the threshold.
    reach = 0.5 * modifier.merge_threshold if modifier.use_mirror_merge else _ON_PLANE * size
    if modifier.mirror_object is None:
        return MirrorPlane.across(axis, reach)
    own, other = world_matrices([obj, modifier.mirror_object])
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
