# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the shape keys of a chain: all of them, or, where something fails, none."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError, QC3DError
from .. import compat
from ..kinds import keys_of, mesh_of, present
from ..store import id_properties, names
from ..store.mesh_data import key_coordinates, set_key_coordinates
from ..store.records import Chain
from . import slider


def owned_keys(keys: bpy.types.Key, chain: Chain) -> dict[int, bpy.types.ShapeKey]:
    """The shape keys that earlier bakes made for a chain and that are still there, by step.

    A key is owned where the record names it and its driver still reads the slider. A name that the record has and the
    mesh has not was deleted or renamed; renamed it is where exactly one other key has that step's driver. A key that
    was moved to the top, where all others refer to it, is the animator's own from then on.
    """
    drivers = slider.driven_by(keys, chain.slider)
    drivers.pop(slider.value_path(keys.reference_key.name), None)
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


def all_owned_keys(keys: bpy.types.Key, chain: Chain) -> dict[int, bpy.types.ShapeKey]:
    """As ``owned_keys``; raises InputError where one is missing."""
    owned = owned_keys(keys, chain)
    if owned.keys() != chain.keys.keys():
        raise InputError(f"Shape keys of '{chain.slider}' were deleted; re-bake it first.")
    return owned


def slider_owner(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object:
    """The object whose slider plays the chain: that of an earlier bake (objects may share a mesh), else ``obj``."""
    for driver in _drivers(keys_of(obj), chain):
        owner = driver.variables[0].targets[0].id
        if isinstance(owner, bpy.types.Object):
            return owner
    return obj


def are_drivers_stopped(keys: bpy.types.Key, chain: Chain) -> bool:
    """Whether Blender has stopped the chain's drivers, which it does for good where the slider was NaN once."""
    driver = next(_drivers(keys, chain), None)
    return driver is not None and not driver.is_valid


def restart_drivers(keys: bpy.types.Key, chain: Chain) -> None:
    """Start drivers again that Blender has stopped."""
    for driver in slider.driven_by(keys, chain.slider).values():
        driver.is_valid = True
    keys.update_tag()


def _drivers(keys: bpy.types.Key, chain: Chain) -> Iterator[bpy.types.Driver]:
    """The drivers that read the chain's slider, those of its own keys first: there may be thousands of others."""
    for name in chain.keys.values():
        driver = slider.driver_of(keys, name, chain.slider)
        if driver is not None:
            yield driver
    yield from slider.driven_by(keys, chain.slider).values()


def require_writable(obj: bpy.types.Object, chain: Chain, keyframes: tuple[int, int] | None) -> None:
    """Check everything that writing the chain may change.

    Raises
    ------
    InputError
        If a key that the bake replaces is locked, the slider is not a number any more, or its object or its action is
        linked.
    """
    owner = _require_unlocked(obj, chain)
    if id_properties.has(owner, chain.slider):
        slider.require(owner, chain.slider)
    if keyframes is not None:
        require_action(owner)


def require_removable(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object:
    """The object that has the chain's slider, where everything that removing the chain changes can be changed.

    Raises
    ------
    InputError
        If a key is locked, or the slider's object or its action is linked.
    """
    owner = _require_unlocked(obj, chain)
    if chain.keyframes is not None:
        require_action(owner)
    return owner


def require_action(block: compat.Animated) -> None:
    """Raise InputError where the keyframes of an object or of shape keys cannot be changed."""
    action = block.animation_data and block.animation_data.action
    if action and (action.library or action.override_library):
        raise InputError(f"The action '{action.name}' is linked; make it local first.")


def _require_unlocked(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object:
    for key in owned_keys(keys_of(obj), chain).values():
        if key.lock_shape:
            raise InputError(f"Shape key '{key.name}' of an earlier bake is locked; unlock it first.")
    owner = slider_owner(obj, chain)
    if owner.library is not None:
        raise InputError(f"'{owner.name}', which has the slider '{chain.slider}', is linked; make it local first.")
    return owner


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
    if frames.ndim != 3 or frames.shape[1:] != (len(mesh_of(obj).vertices), 3):
        raise QC3DError(
            f"The in-betweens have shape {frames.shape} for {len(mesh_of(obj).vertices)} vertices; please report this."
        )
    with np.errstate(over="ignore"):  # what does not fit is infinite, and refused below
        rounded = frames.astype(np.float32)
    if not np.isfinite(rounded).all():
        raise QC3DError("An in-between has coordinates that are not finite; try another quality or engine.")
    shapes = dict(enumerate(rounded))
    for step, name in met.items():
        if name == keys_of(obj).reference_key.name:
            del shapes[step]
        else:
            shapes[step] = key_coordinates(obj, name)
    return shapes


@contextmanager
def chain_written(
    obj: bpy.types.Object,
    chain: Chain,
    shapes: dict[int, NDArray[np.float32]],
    intervals: int,
    keyframes: tuple[int, int] | None,
) -> Iterator[tuple[ExitStack, list[str]]]:
    """Put the shapes of a chain into shape keys that one slider drives; where that or the block fails, take it back.

    Keys of an earlier bake with as many steps keep their place, name and driver and get the new shape; those of
    another number are replaced when the block ends. No other key changes.

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

    Yields
    ------
    What takes everything back where the block fails, to add to, and sentences for the user.

    Raises
    ------
    InputError
        If a key or action cannot be written, or the slider is not a number any more.
    """
    require_writable(obj, chain, keyframes)
    keys, owner = keys_of(obj), slider_owner(obj, chain)
    owned = owned_keys(keys, chain)
    kept = {step: key for step, key in owned.items() if chain.intervals == intervals and step in shapes}
    stale = [key for step, key in owned.items() if step not in kept]
    active = obj.active_shape_key
    curve: bpy.types.FCurve | None = None
    notes: list[str] = []
    with ExitStack() as undo:
        undo.callback(_activate, obj, active)
        # A slider that starts where it shows the Basis leaves the object looking as it did.
        start = min(set(range(intervals + 1)) - shapes.keys(), default=0)
        slider.ensure_property(owner, chain.slider, start / intervals, undo)
        written = dict(kept)
        for step, key in kept.items():
            undo.callback(set_key_coordinates, key, key_coordinates(obj, key.name))
            set_key_coordinates(key, shapes[step])
            undo.callback(setattr, key, "relative_key", key.relative_key)
            key.relative_key = keys.reference_key  # another one may have been moved to the top
            slider.retarget(present(slider.driver_of(keys, key.name, chain.slider)), owner, undo)
        for step in shapes.keys() - kept.keys():
            name = names.key_name(chain.slider, step, intervals)
            written[step] = _new_key(obj, name, undo)
            set_key_coordinates(written[step], shapes[step])
            slider.drive(written[step], owner, chain.slider, step, intervals)
        if keyframes is not None:
            curve, notes = slider.begin_keyframes(owner, chain, keyframes, undo)
        chain.intervals = intervals
        chain.keys = {step: written[step].name for step in sorted(written)}
        chain.keyframes = chain.keyframes if curve is None else keyframes
        yield undo, notes
        undo.pop_all()
    # Nothing below can fail for a reason that was not checked before anything was written.
    if curve is not None and keyframes is not None:
        slider.set_keyframes(curve, keyframes)
    remove_keys(obj, stale)


def remove_keys(obj: bpy.types.Object, stale: list[bpy.types.ShapeKey]) -> None:
    """Remove shape keys with their drivers; the active key stays active where it is not one of them."""
    active = None if obj.active_shape_key in stale else obj.active_shape_key
    for key in stale:
        _remove_key(obj, key)
    _activate(obj, active)
    keys_of(obj).update_tag()


def remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    """Remove a shape key that no driver drives; the active key stays active where it is not this one."""
    active = None if obj.active_shape_key == key else obj.active_shape_key
    obj.shape_key_remove(key)
    _activate(obj, active)


def _new_key(obj: bpy.types.Object, name: str, undo: ExitStack) -> bpy.types.ShapeKey:
    key = obj.shape_key_add(name=name, from_mix=False)
    undo.callback(_remove_key, obj, key)
    key.value = 0.0  # Blender 5 starts with 1
    key.relative_key = keys_of(obj).reference_key
    return key


def _remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    # Removing a key together with its driver leaves the driver in the dependency graph, and Blender crashes at the
    # next update; removing the driver first has the graph rebuilt.
    slider.undrive(key)
    obj.shape_key_remove(key)


def _activate(obj: bpy.types.Object, key: bpy.types.ShapeKey | None) -> None:
    obj.active_shape_key_index = 0 if key is None else keys_of(obj).key_blocks.find(key.name)
