# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a slider does over a range of frames, as keyframes of the shape keys themselves."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from .. import compat
from ..keys import shape_keys, slider
from ..store.records import Chain, Record
from . import remove


def slider_values(context: bpy.types.Context, owner: bpy.types.Object, name: str, frames: range) -> NDArray[np.float64]:
    """(k,) where a slider is at each of ``frames``, whatever animates it: keyframes, drivers, strips."""
    scene = context.scene
    current, part = scene.frame_current, scene.frame_subframe
    values = []
    try:
        for frame in frames:
            scene.frame_set(frame)
            values.append(float(owner.evaluated_get(context.evaluated_depsgraph_get())[name]))
    finally:
        scene.frame_set(current, subframe=part)
    return np.array(values)


def key_values(chain: Chain, step: int, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) values of the key at a step where the slider is at ``places`` (k,): what its driver gives."""
    return np.maximum(0.0, 1.0 - np.abs(places * chain.intervals - step))


def bake_to_keyframes(
    context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain, frames: range
) -> list[str]:
    """Give the keys of a chain keyframes in place of drivers, and let them go: they are the animator's own then.

    Returns
    -------
    Sentences about what was left because other work depends on it.

    Raises
    ------
    InputError
        If the slider is gone, or a key or an action cannot be changed; nothing was changed.
    """
    keys = obj.data.shape_keys
    shape_keys.require_writable(obj, chain, None)
    action = keys.animation_data and keys.animation_data.action
    if action and (action.library or action.override_library):
        raise InputError(f"The action '{action.name}' is linked; make it local first.")
    owner = shape_keys.slider_owner(obj, chain)
    if chain.slider not in owner:
        raise InputError(f"The slider '{chain.slider}' was deleted; re-bake it first.")
    places = slider_values(context, owner, chain.slider, frames)
    for step, key in shape_keys.owned_keys(keys, chain).items():
        values = key_values(chain, step, places)
        slider.undrive(key)
        curve = compat.ensure_fcurve(keys, slider.value_path(key.name))
        _set_keyframes(curve, np.array(frames, dtype=np.float64), values)
        key.value = float(values[0])
    remove.forget_chain(obj, record, chain)
    notes = remove.remove_slider(owner, chain)
    keys.update_tag()
    context.scene.frame_set(context.scene.frame_current, subframe=context.scene.frame_subframe)
    return notes


def _set_keyframes(curve: bpy.types.FCurve, frames: NDArray[np.float64], values: NDArray[np.float64]) -> None:
    """Linear keyframes, those left out that lie on the line between their neighbours."""
    turns = np.ones(len(values), dtype=bool)
    turns[1:-1] = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2]) > 1e-9
    frames, values = frames[turns], values[turns]
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(frames))
    curve.keyframe_points.foreach_set("co", np.column_stack([frames, values]).ravel())
    linear = bpy.types.Keyframe.bl_rna.properties["interpolation"].enum_items['LINEAR'].value
    curve.keyframe_points.foreach_set("interpolation", [linear] * len(frames))
    curve.update()
