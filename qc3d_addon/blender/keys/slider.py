# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A slider for a chain, as a custom property of the object, and its keyframes.

The slider shows the first key at 0, the last at 1, and the others in between. It plays copies of the user's keys that
the bake makes, since those themselves stay untouched; the Basis needs no copy. If the first key is not the Basis, the
slider therefore shows it from the moment of the bake on. Other keys with values add to it, as shape keys always do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any

import bpy
import numpy as np

from .. import compat
from ..store import id_properties
from ..store.chain import Chain
from .control import Control, slider_path

Keyframes = Sequence[tuple[float, float]]  # frames and values
_ROUNDING = 1e-6  # frames and values are in single precision


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
    control: Control, chain: Chain, wanted: Keyframes, undo: ExitStack
) -> tuple[bpy.types.FCurve | None, list[str]]:
    """The curve that gets the keyframes, or None if it stays as it is, and sentences that say why.

    The user's own keyframes are never replaced, and neither are those of an earlier bake at the same frames, whose
    timing may have been edited since. Closing ``undo`` undoes what was made.

    Parameters
    ----------
    chain
        The chain, with the keyframes of its previous bake.
    """
    owner, path = control.owner, control.path
    what = f"key '{control.name}'" if control.is_key else f"slider '{control.name}'"
    if owner.animation_data is not None and owner.animation_data.drivers.find(path) is not None:
        return None, [f"The {what} is driven and got no keyframes."]
    existing = compat.find_fcurve(owner, path)
    if existing is not None and len(existing.keyframe_points):
        if chain.keyframes is None:
            return None, [f"The {what} is already animated; its keyframes were left as they are."]
        made = chain.keyframe_values
        if made == list(wanted):
            return None, []
        found = np.array([point.co for point in existing.keyframe_points])
        if found.shape != np.shape(made) or not np.allclose(found, made, rtol=_ROUNDING, atol=_ROUNDING):
            return None, [f"The keyframes of the {what} were edited and were left as they are."]
    return compat.ensure_fcurve(owner, path, undo), []


def set_keyframes(curve: bpy.types.FCurve, wanted: Keyframes) -> None:
    """Replace the keyframes of a curve by linear ones."""
    while len(curve.keyframe_points):
        curve.keyframe_points.remove(curve.keyframe_points[0], fast=True)
    for frame, value in wanted:
        curve.keyframe_points.insert(frame, value, options={'FAST'}).interpolation = 'LINEAR'
    curve.update()
