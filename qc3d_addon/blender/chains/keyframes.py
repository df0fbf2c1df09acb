# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces slider and drivers by keyframes of the shape keys themselves, over a range of frames."""

from __future__ import annotations

from contextlib import ExitStack

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import compat
from ..bake import bookkeeping
from ..keys import chain_keys, drivers, shape_keys
from ..keys.control import Control, value_path
from ..kinds import expect, keys_of, present
from ..store.chain import Chain
from ..store.records import Record
from . import remove


def positions(context: bpy.types.Context, control: Control, frames: range) -> NDArray[np.float64]:
    """(k,) values of a control at each of ``frames``, whatever animates it: keyframes, drivers or NLA strips.

    Raises
    ------
    InputError
        If the slider does not exist, or is not a number at one of the frames.
    """
    scene = present(context.scene)
    current, part = scene.frame_current, scene.frame_subframe
    values = []
    try:
        for frame in frames:
            scene.frame_set(frame)
            evaluated = control.of(control.owner.evaluated_get(context.evaluated_depsgraph_get()))
            evaluated.require()
            values.append(evaluated.value)
    finally:
        scene.frame_set(current, subframe=part)
    return np.array(values)


def bake_to_keyframes(
    context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain, frames: range
) -> list[str]:
    """Replace the drivers of a chain's keys by keyframes and forget the chain: its keys are the user's own then.

    Returns
    -------
    list of str
        Sentences about what was replaced, and about what stays because the user's own work depends on it.

    Raises
    ------
    InputError
        If the slider does not exist or is not a number, or a key or an action cannot be changed; nothing is changed
        then.
    """
    keys, scene = keys_of(obj), present(context.scene)
    control = shape_keys.require_removable(obj, chain)
    shape_keys.require_action(keys)
    control.require()
    # Clipped to the range of shape keys, and since infinite positions have no weights.
    values = chain.weights.at(np.clip(positions(context, control, frames), -10.0, 10.0)).clip(-10.0, 10.0)
    owned = chain_keys.owned_keys(keys, chain)
    notes, animated = [], []
    with ExitStack() as undo:
        for step, key in owned.items():
            curve = compat.ensure_fcurve(keys, value_path(key.name), undo)
            if len(curve.keyframe_points):
                notes.append(f"Keyframes of '{key.name}', which its driver had overridden, were replaced.")
            animated.append((key, curve, values[:, step]))
        bookkeeping.forget(keys, record, chain, undo)
        undo.pop_all()
    _put_in_place(animated, np.array(frames, dtype=np.float64))
    remove.hide_heat_map(obj, chain)
    notes += remove.remove_slider(control, chain)
    if chain.muted:
        notes.append("Keyframes that the bake muted stay muted, since the keyframes of the in-betweens replace them.")
    keys.update_tag()
    scene.frame_set(scene.frame_current, subframe=scene.frame_subframe)
    return notes


def _put_in_place(
    animated: list[tuple[bpy.types.ShapeKey, bpy.types.FCurve, NDArray[np.float64]]], frames: NDArray[np.float64]
) -> None:
    """Replace the drivers of keys by keyframes with these values at ``frames``."""
    for key, curve, values in animated:
        drivers.undrive(key)
        _set_keyframes(curve, frames, values)
        key.value = float(values[0])


def _set_keyframes(curve: bpy.types.FCurve, frames: NDArray[np.float64], values: NDArray[np.float64]) -> None:
    """Set linear keyframes, except those on the straight line between their neighbors."""
    turns = np.ones(len(values), dtype=bool)
    turns[1:-1] = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2]) > 1e-9
    frames, values = frames[turns], values[turns]
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(frames))
    curve.keyframe_points.foreach_set("co", np.column_stack([frames, values]).ravel())
    interpolations = expect(bpy.types.EnumProperty, bpy.types.Keyframe.bl_rna.properties["interpolation"])
    linear = interpolations.enum_items['LINEAR'].value
    curve.keyframe_points.foreach_set("interpolation", [linear] * len(frames))
    curve.update()
