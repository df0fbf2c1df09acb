# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the shape keys of a chain: all of them, or, where something fails, none."""

from __future__ import annotations

from collections.abc import Container, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError, QC3DError
from ..store import names
from ..store.mesh_data import key_coordinates, set_key_coordinates, shown_coordinates
from ..store.records import LEAST_DISTANCE, Chain
from . import drivers, slider
from .control import Control, path_of, value_path

if TYPE_CHECKING:
    from ...solver.frames.weights import Weights


class Steps(NamedTuple):
    """Where the steps of a chain are on its control, as ``Chain`` has it."""

    places: tuple[float, ...]
    corners: tuple[int, ...]


def owned_keys(keys: bpy.types.Key, chain: Chain) -> dict[int, bpy.types.ShapeKey]:
    """The shape keys that earlier bakes made for a chain and that are still there, by step.

    A key is owned where the record names it and its driver still reads the control. A name that the record has and the
    mesh has not was deleted or renamed; renamed it is where exactly one other key has that step's driver. A key that
    was moved to the top, where all others refer to it, is the animator's own from then on.
    """
    curves = drivers.driven_by(keys, path_of(chain))
    curves.pop(value_path(keys.reference_key.name), None)
    owned, missing = {}, []
    for step, name in chain.keys.items():
        if name in keys.key_blocks and value_path(name) in curves:
            owned[step] = keys.key_blocks[name]
        else:
            missing.append(step)
    recorded = set(owned.values())
    others = [key for key in keys.key_blocks if key not in recorded and value_path(key.name) in curves]
    weights = chain.weights if missing and others else None
    for step in missing if weights is not None else ():
        renamed = [key for key in others if drivers.shows(curves[value_path(key.name)], weights, step)]
        if len(renamed) == 1:
            owned[step] = renamed[0]
    return owned


def all_owned_keys(keys: bpy.types.Key, chain: Chain) -> dict[int, bpy.types.ShapeKey]:
    """As ``owned_keys``; raises InputError where one is missing."""
    owned = owned_keys(keys, chain)
    if owned.keys() != chain.keys.keys():
        raise InputError(f"Shape keys of '{chain.slider}' were deleted; re-bake it first.")
    return owned


def control_of(obj: bpy.types.Object, chain: Chain) -> Control:
    """What plays the chain: a key's value, or its slider.

    The slider is that on the object of an earlier bake (objects may share a mesh), else that on ``obj``.
    """
    if chain.on_key:
        return Control(obj.data.shape_keys, chain.on_key)
    for driver in _drivers(obj.data.shape_keys, chain):
        owner = driver.variables[0].targets[0].id
        if isinstance(owner, bpy.types.Object):
            return Control(owner, chain.slider)
    return Control(obj, chain.slider)


def are_drivers_stopped(keys: bpy.types.Key, chain: Chain) -> bool:
    """Whether Blender has stopped the chain's drivers, which it does for good where the slider was NaN once."""
    driver = next(_drivers(keys, chain), None)
    return driver is not None and not driver.is_valid


def restart_drivers(keys: bpy.types.Key, chain: Chain) -> None:
    """Start drivers again that Blender has stopped."""
    for curve in drivers.driven_by(keys, path_of(chain)).values():
        curve.driver.is_valid = True
    keys.update_tag()


def _drivers(keys: bpy.types.Key, chain: Chain) -> Iterator[bpy.types.Driver]:
    """The drivers that read the chain's slider, those of its own keys first: there may be thousands of others."""
    path = path_of(chain)
    for name in chain.keys.values():
        driver = drivers.driver_of(keys, name, path)
        if driver is not None:
            yield driver
    yield from (curve.driver for curve in drivers.driven_by(keys, path).values())


def require_writable(obj: bpy.types.Object, chain: Chain, keyframes: tuple[int, int] | None) -> None:
    """Check everything that writing the chain may change.

    Raises
    ------
    InputError
        If a key that the bake replaces is locked, the slider is not a number any more, or its object or its action is
        linked.
    """
    control = _require_unlocked(obj, chain)
    if control.is_there:
        control.require()
    if keyframes is not None:
        require_action(control.owner)


def require_removable(obj: bpy.types.Object, chain: Chain) -> Control:
    """What plays the chain, where everything that removing the chain changes can be changed.

    Raises
    ------
    InputError
        If a key is locked, or the slider's object or its action is linked.
    """
    control = _require_unlocked(obj, chain)
    if chain.keyframes is not None:
        require_action(control.owner)
    return control


def require_action(block: bpy.types.ID) -> None:
    """Raise InputError where the keyframes of an object or of shape keys cannot be changed."""
    action = block.animation_data and block.animation_data.action
    if action and (action.library or action.override_library):
        raise InputError(f"The action '{action.name}' is linked; make it local first.")


def _require_unlocked(obj: bpy.types.Object, chain: Chain) -> Control:
    for key in owned_keys(obj.data.shape_keys, chain).values():
        if key.lock_shape:
            raise InputError(f"Shape key '{key.name}' of an earlier bake is locked; unlock it first.")
    control = control_of(obj, chain)
    if control.owner.library is not None:
        name = control.owner.name
        raise InputError(f"'{name}', which has the slider '{chain.slider}', is linked; make it local first.")
    return control


def shapes_by_step(
    obj: bpy.types.Object, met: dict[int, str], frames: NDArray[np.float64]
) -> dict[int, NDArray[np.float32]]:
    """The shapes that a slider of its own needs keys for: every frame but the Basis, which shows where no key is on.

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
    shapes = dict(enumerate(_rounded(obj, frames)))
    for step, name in met.items():
        if name == obj.data.shape_keys.reference_key.name:
            del shapes[step]
        else:
            shapes[step] = shown_coordinates(obj, name)
    return shapes


def offsets_by_step(
    obj: bpy.types.Object, places: tuple[float, ...], frames: NDArray[np.float64]
) -> dict[int, NDArray[np.float32]]:
    """What keys that a key's own value plays add to it: at each step, what its frame has beyond the straight blend.

    Parameters
    ----------
    places
        Of the steps, as values of the key.
    frames
        (k, n, 3) positions at them, from what the key is relative to up to the key.

    Returns
    -------
    (n, 3) float32 by step, absolute positions for keys that are relative to what that key is relative to.

    Raises
    ------
    QC3DError
        If the frames are not finite positions of the mesh's vertices.
    """
    at = np.array(places)[:, None, None]
    offsets = _rounded(obj, frames - at * (frames[-1] - frames[0]))
    return {step: offsets[step] for step in range(1, len(places) - 1)}


def step_shapes(obj: bpy.types.Object, chain: Chain) -> NDArray[np.float64]:
    """(k, n, 3) what a chain's control shows at each of its steps, whatever was sculpted since.

    Raises
    ------
    InputError
        If keys of the chain are missing.
    """
    keys = obj.data.shape_keys
    owned = all_owned_keys(keys, chain)
    first = key_coordinates(obj, base_key(keys, chain).name).astype(np.float64)
    # What the key itself adds where its own value plays the chain.
    whole = shown_coordinates(obj, chain.on_key) - first if chain.on_key else np.zeros_like(first)
    return np.stack(
        [
            (key_coordinates(obj, owned[step].name) if step in owned else first) + place * whole
            for step, place in enumerate(chain.places)
        ]
    )


def base_key(keys: bpy.types.Key, chain: Chain) -> bpy.types.ShapeKey:
    """What the chain's keys are relative to: that of the key that plays them, or the Basis."""
    key = keys.key_blocks.get(chain.on_key) if chain.on_key else None
    return keys.reference_key if key is None else key.relative_key


def _rounded(obj: bpy.types.Object, frames: NDArray[np.float64]) -> NDArray[np.float32]:
    """Frames (k, n, 3) as shape keys hold them; raises QC3DError where they cannot."""
    if frames.ndim != 3 or frames.shape[1:] != (len(obj.data.vertices), 3):
        raise QC3DError(
            f"The in-betweens have shape {frames.shape} for {len(obj.data.vertices)} vertices; please report this."
        )
    with np.errstate(over="ignore"):  # what does not fit is infinite, and refused below
        rounded = frames.astype(np.float32)
    if not np.isfinite(rounded).all():
        raise QC3DError("An in-between has coordinates that are not finite; try another quality or engine.")
    return np.asarray(rounded)


@contextmanager
def chain_written(
    obj: bpy.types.Object,
    chain: Chain,
    shapes: dict[int, NDArray[np.float32]],
    steps: Steps,
    keyframes: tuple[int, int] | None,
) -> Iterator[tuple[ExitStack, list[str]]]:
    """Put the shapes of a chain into shape keys that one control plays; where that or the block fails, take it back.

    Keys of an earlier bake at the same place keep their name and order and get the new shape; those at other places
    are replaced when the block ends. No other key changes.

    Parameters
    ----------
    obj
        The object of the mesh.
    chain
        The record of the chain, which is brought up to date.
    shapes
        (n, 3) float32 absolute positions by step; steps left out need no key.
    steps
        Where the steps are.
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
    keys, control = obj.data.shape_keys, control_of(obj, chain)
    base = base_key(keys, chain)
    owned = owned_keys(keys, chain)
    kept = _kept(chain, owned, steps.places, shapes)
    stale = [key for key in owned.values() if key not in kept.values()]
    active = obj.active_shape_key
    curve, notes = None, []
    with ExitStack() as undo:
        undo.callback(_activate, obj, active)
        if not control.is_key:
            # A slider that starts where it shows the Basis leaves the object looking as it did.
            start = min(set(range(len(steps.places))) - shapes.keys(), default=0)
            slider.ensure_property(control.owner, chain.slider, steps.places[start], undo)
        undo.callback(setattr, chain, "places", chain.places)
        undo.callback(setattr, chain, "corners", chain.corners)
        chain.places, chain.corners = steps
        weights = chain.weights
        written = dict(kept)
        for step, key in kept.items():
            undo.callback(set_key_coordinates, key, key_coordinates(obj, key.name))
            set_key_coordinates(key, shapes[step])
            undo.callback(setattr, key, "relative_key", key.relative_key)
            key.relative_key = base  # another one may have been moved to the top
        for step in sorted(shapes.keys() - kept.keys()):
            written[step] = _new_key(obj, names.key_name(chain.slider, step, steps.places), base, undo)
            set_key_coordinates(written[step], shapes[step])
            drivers.drive_value(written[step], control, weights, step)
            if control.is_key:
                drivers.drive_mute(written[step], control)
        if keyframes is not None:
            curve, notes = slider.begin_keyframes(control, chain, keyframes, undo)
        chain.keys = {step: written[step].name for step in sorted(written)}
        chain.keyframes = chain.keyframes if curve is None else keyframes
        yield undo, notes
        undo.pop_all()
    # Nothing below can fail for a reason that was not checked before anything was written.
    _let_play(kept, control, weights)
    if curve is not None:
        slider.set_keyframes(curve, keyframes)
    remove_keys(obj, stale)


def _let_play(kept: dict[int, bpy.types.ShapeKey], control: Control, weights: Weights) -> None:
    """Give keys of an earlier bake the weights of this one."""
    for step, key in kept.items():
        if (key.slider_min, key.slider_max) == (0.0, 1.0):  # else the user chose it
            _widen(key)
        drivers.drive_value(key, control, weights, step)
        if control.is_key:
            drivers.drive_mute(key, control)


def _kept(
    chain: Chain, owned: dict[int, bpy.types.ShapeKey], places: tuple[float, ...], shapes: Container[int]
) -> dict[int, bpy.types.ShapeKey]:
    """The keys of an earlier bake that are where new ones are wanted, by their steps from now on."""
    known = np.array(places)
    steps = {step: int(np.abs(known - chain.places[step]).argmin()) for step in owned}
    return {
        steps[step]: key
        for step, key in owned.items()
        if abs(places[steps[step]] - chain.places[step]) < LEAST_DISTANCE and steps[step] in shapes
    }


def remove_keys(obj: bpy.types.Object, stale: list[bpy.types.ShapeKey]) -> None:
    """Remove shape keys with their drivers; the active key stays active where it is not one of them."""
    active = None if obj.active_shape_key in stale else obj.active_shape_key
    for key in stale:
        _remove_key(obj, key)
    _activate(obj, active)
    obj.data.shape_keys.update_tag()


def remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    """Remove a shape key that no driver drives; the active key stays active where it is not this one."""
    active = None if obj.active_shape_key == key else obj.active_shape_key
    obj.shape_key_remove(key)
    _activate(obj, active)


def _new_key(obj: bpy.types.Object, name: str, base: bpy.types.ShapeKey, undo: ExitStack) -> bpy.types.ShapeKey:
    key = obj.shape_key_add(name=name, from_mix=False)
    undo.callback(_remove_key, obj, key)
    key.value = 0.0  # Blender 5 starts with 1
    _widen(key)
    key.relative_key = base
    return key


def _widen(key: bpy.types.ShapeKey) -> None:
    """Let a key have the values of smooth weights, which leave 0 to 1; Blender allows no more."""
    key.slider_min, key.slider_max = -10.0, 10.0


def _remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    # Removing a key together with its driver leaves the driver in the dependency graph, and Blender crashes at the
    # next update; removing the driver first has the graph rebuilt.
    drivers.undrive(key)
    obj.shape_key_remove(key)


def _activate(obj: bpy.types.Object, key: bpy.types.ShapeKey | None) -> None:
    obj.active_shape_key_index = 0 if key is None else obj.data.shape_keys.key_blocks.find(key.name)
