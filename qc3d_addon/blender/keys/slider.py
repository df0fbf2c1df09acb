# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A slider for a chain, as a custom property of the object, and its keyframes.

The slider shows the first key at 0, the last at 1, and the others in between. It plays copies of the user's keys that
the bake makes, since those themselves stay untouched; the Basis needs no copy. If the first key is not the Basis, the
slider therefore shows it from the moment of the bake on. Other keys with values add to it, as shape keys always do.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import bpy

from .. import compat
from ..store import id_properties
from ..store.records import Chain
from .control import Control, slider_path


def ensure_property(obj: bpy.types.Object, name: str, start: float, undo: ExitStack) -> None:
    """Add the slider to ``obj``; an existing one keeps its value. Closing ``undo`` removes a new one."""
    if not id_properties.has(obj, name):
        undo.callback(obj.pop, name, None)
        obj[name] = start
        interface: Callable[[str], Any] = obj.id_properties_ui  # the stubs say that it returns nothing
        interface(name).update(
            min=-1.0,
            max=2.0,
            soft_min=0.0,
            soft_max=1.0,
            step=1.0,
            default=start,
            description="Plays the in-betweens: 0 is the first key, 1 the last; beyond them the motion continues",
        )
        # So that a linked character can be animated with it.
        obj.property_overridable_library_set(slider_path(name), True)


def begin_keyframes(
    control: Control, chain: Chain, wanted: tuple[int, int], undo: ExitStack
) -> tuple[bpy.types.FCurve | None, list[str]]:
    """The curve that gets keyframes at two frames, or None if it stays as it is, and sentences that say why.

    The user's own keyframes are never replaced, and neither are those of an earlier bake at the same frames, whose
    timing may have been edited since. Closing ``undo`` undoes what was made.
    """
    owner, path = control.owner, control.path
    what = f"key '{control.name}'" if control.is_key else f"slider '{control.name}'"
    if owner.animation_data is not None and owner.animation_data.drivers.find(path) is not None:
        return None, [f"The {what} is driven and got no keyframes."]
    existing = compat.find_fcurve(owner, path)
    if existing is not None and len(existing.keyframe_points):
        if chain.keyframes is None:
            return None, [f"The {what} is already animated; its keyframes were left as they are."]
        if chain.keyframes == wanted:
            return None, []
        made = [*zip(chain.keyframes, (0.0, 1.0), strict=True)]
        if [(point.co.x, point.co.y) for point in existing.keyframe_points] != made:
            return None, [f"The keyframes of the {what} were edited and were left as they are."]
    return compat.ensure_fcurve(owner, path, undo), []


def set_keyframes(curve: bpy.types.FCurve, frames: tuple[int, int]) -> None:
    """Replace the keyframes of a curve by linear ones from 0 at the first frame to 1 at the second."""
    while len(curve.keyframe_points):
        curve.keyframe_points.remove(curve.keyframe_points[0], fast=True)
    for frame, value in zip(frames, (0.0, 1.0), strict=True):
        curve.keyframe_points.insert(frame, value, options={'FAST'}).interpolation = 'LINEAR'
    curve.update()
