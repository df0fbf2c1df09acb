# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the shape keys of a chain: all of them, or, where something fails, none."""

from __future__ import annotations

from contextlib import ExitStack

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError, QC3DError
from ..store import names
from ..store.mesh_data import key_coordinates, set_key_coordinates
from ..store.records import Chain
from . import slider


def owned_keys(keys: bpy.types.Key, chain: Chain) -> dict[int, bpy.types.ShapeKey]:
    """The shape keys that earlier bakes made for a chain and that are still there, by step.

    A key is owned where the record names it and its driver still reads the slider. A name that the record has and the
    mesh has not was deleted or renamed; renamed it is where exactly one other key has that step's driver.
    """
    drivers = slider.driven_by(keys, chain.slider)
    owned, missing = {}, []
    for step, name in chain.keys.items():
        if name in keys.key_blocks and slider.value_path(name) in drivers:
            owned[step] = keys.key_blocks[name]
        else:
            missing.append(step)
    recorded = set(owned.values())
    others = [key for key in keys.key_blocks if key not in recorded and slider.value_path(key.name) in drivers]
    for step in missing:
        expression = slider.expression(step, chain.intervals)
        renamed = [key for key in others if drivers[slider.value_path(key.name)].expression == expression]
        if len(renamed) == 1:
            owned[step] = renamed[0]
    return owned


def slider_owner(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object:
    """The object whose slider plays the chain: that of an earlier bake (objects may share a mesh), else ``obj``."""
    for driver in slider.driven_by(obj.data.shape_keys, chain.slider).values():
        if driver.variables[0].targets[0].id is not None:
            return driver.variables[0].targets[0].id
    return obj


def require_writable(obj: bpy.types.Object, chain: Chain, keyframes: tuple[int, int] | None) -> None:
    """Check everything that writing the chain may change.

    Raises
    ------
    InputError
        If a key that the bake replaces is locked, or the slider's object or its action is linked.
    """
    for key in owned_keys(obj.data.shape_keys, chain).values():
        if key.lock_shape:
            raise InputError(f"Shape key '{key.name}' of an earlier bake is locked; unlock it to bake again.")
    owner = slider_owner(obj, chain)
    if owner.library is not None:
        raise InputError(f"'{owner.name}', which has the slider '{chain.slider}', is linked; make it local first.")
    action = owner.animation_data and owner.animation_data.action
    if keyframes is not None and action and (action.library or action.override_library):
        raise InputError(f"The action '{action.name}' is linked; make it local, or bake without keyframes.")


def shapes_by_step(
    obj: bpy.types.Object, met: dict[int, str], frames: NDArray[np.float64]
) -> dict[int, NDArray[np.float32]]:
    """The shapes of a chain that need a shape key: every frame but the Basis, which shows where no key is on.

    Parameters
    ----------
    met
        Names of the user's own keys by the step that shows them.
    frames
        (k, n, 3) positions from the first key to the last.

    Returns
    -------
    (n, 3) float32 positions by step, the user's keys bit for bit.

    Raises
    ------
    QC3DError
        If the frames are not finite positions of the mesh's vertices.
    """
    if frames.ndim != 3 or frames.shape[1:] != (len(obj.data.vertices), 3):
        raise QC3DError(
            f"The in-betweens have shape {frames.shape} for {len(obj.data.vertices)} vertices; please report this."
        )
    with np.errstate(over="ignore"):  # what does not fit is infinite, and refused below
        rounded = frames.astype(np.float32)
    if not np.isfinite(rounded).all():
        raise QC3DError("An in-between has coordinates that are not finite; try another quality or engine.")
    shapes = dict(enumerate(rounded))
    for step, name in met.items():
        if name == obj.data.shape_keys.reference_key.name:
            del shapes[step]
        else:
            shapes[step] = key_coordinates(obj, name)
    return shapes


def write_chain(
    obj: bpy.types.Object,
    chain: Chain,
    shapes: dict[int, NDArray[np.float32]],
    intervals: int,
    keyframes: tuple[int, int] | None,
) -> list[str]:
    """Put the shapes of a chain into shape keys that one slider drives; where that fails, nothing is changed.

    Keys of an earlier bake with as many steps keep their place, name and driver and get the new shape; those of
    another number are replaced. No other key changes.

    Parameters
    ----------
    obj
        The object of the mesh.
    chain
        The record of the chain, which is brought up to date.
    shapes
        (n, 3) float32 absolute positions by step, 0 to ``intervals``; steps left out show the Basis.
    intervals
        Number of steps from the first key to the last.
    keyframes
        First and last frame of the slider's keyframes, or None for none.

    Returns
    -------
    Sentences for the user.
    """
    keys = obj.data.shape_keys
    owner = slider_owner(obj, chain)
    owned = owned_keys(keys, chain)
    kept = {step: key for step, key in owned.items() if chain.intervals == intervals and step in shapes}
    stale = [key for step, key in owned.items() if step not in kept]
    active = obj.active_shape_key
    notes = []
    with ExitStack() as undo:
        undo.callback(_activate, obj, active)
        # A slider that starts where it shows the Basis leaves the object looking as it did.
        start = min(set(range(intervals + 1)) - shapes.keys(), default=0)
        if slider.ensure_property(owner, chain.slider, start / intervals):
            undo.callback(owner.pop, chain.slider)
        written = dict(kept)
        for step in shapes.keys() - kept.keys():
            name = names.key_name(chain.slider, step, intervals)
            written[step] = _new_key(obj, name, undo)
            set_key_coordinates(written[step], shapes[step])
            slider.drive(written[step], owner, chain.slider, step, intervals)
        if keyframes is not None:
            note = slider.set_keyframes(owner, chain, keyframes)
            notes += [note] if note else []
        undo.pop_all()
    # Nothing below can fail for a reason that was not checked before anything was written.
    for step, key in kept.items():
        set_key_coordinates(key, shapes[step])
        slider.retarget(key, owner, chain.slider)
    chain.intervals = intervals
    chain.keys = {step: written[step].name for step in sorted(written)}
    active = None if active in stale else active
    for key in stale:
        _remove_key(obj, key)
    _activate(obj, active)
    keys.update_tag()
    return notes


def remove_keys(obj: bpy.types.Object, chain: Chain) -> None:
    """Remove the shape keys of a chain; the active key stays active where it is not one of them."""
    active, stale = obj.active_shape_key, list(owned_keys(obj.data.shape_keys, chain).values())
    active = None if active in stale else active
    for key in stale:
        _remove_key(obj, key)
    _activate(obj, active)
    obj.data.shape_keys.update_tag()


def remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    """Remove a shape key that no driver drives; the active key stays active where it is not this one."""
    active = None if obj.active_shape_key == key else obj.active_shape_key
    obj.shape_key_remove(key)
    _activate(obj, active)


def _new_key(obj: bpy.types.Object, name: str, undo: ExitStack) -> bpy.types.ShapeKey:
    key = obj.shape_key_add(name=name, from_mix=False)
    undo.callback(_remove_key, obj, key)
    key.value = 0.0  # Blender 5 starts with 1
    key.relative_key = obj.data.shape_keys.reference_key
    return key


def _remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    # Removing a key together with its driver leaves the driver in the dependency graph, and Blender crashes at the
    # next update; removing the driver first has the graph rebuilt.
    slider.undrive(key)
    obj.shape_key_remove(key)


def _activate(obj: bpy.types.Object, key: bpy.types.ShapeKey | None) -> None:
    obj.active_shape_key_index = 0 if key is None else obj.data.shape_keys.key_blocks.find(key.name)
