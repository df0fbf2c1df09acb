# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the shape keys of a chain: all of them or, if anything fails, none."""

from __future__ import annotations

from collections.abc import Container, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from .. import compat
from ..kinds import keys_of
from ..store import names
from ..store.chain import Chain
from ..store.chain_values import LEAST_DISTANCE, keyframe_values
from ..store.mesh_data import key_coordinates, set_key_coordinates
from . import drivers, slider
from .chain_keys import base_key, control_of, owned_keys
from .control import Control, key_path, value_path

if TYPE_CHECKING:
    from ...solver.frames.weights import Weights


RANGE = (-10.0, 10.0)  # of made keys: Blender's maximum


class Steps(NamedTuple):
    """Places and corners of the steps of a chain, as in ``Chain``."""

    places: tuple[float, ...]
    corners: tuple[int, ...]


def require_writable(obj: bpy.types.Object, chain: Chain, keyframes: tuple[int, ...] | None) -> None:
    """Check everything that writing the chain may change.

    Raises
    ------
    InputError
        If the slider is no longer a number, or its object or its action is linked.
    """
    control = _require_local(obj, chain)
    if control.is_there:
        control.require()
    if keyframes is not None:
        require_action(control.owner)


def require_removable(obj: bpy.types.Object, chain: Chain) -> Control:
    """The control of the chain, after checking everything that removing the chain changes.

    Raises
    ------
    InputError
        If a key is locked, or the slider's object or its action is linked.
    """
    for key in owned_keys(keys_of(obj), chain).values():
        if key.lock_shape:
            raise InputError(f"Shape key '{key.name}' of an earlier bake is locked; unlock it first.")
    control = _require_local(obj, chain)
    if chain.keyframes is not None:
        require_action(control.owner)
    return control


def require_action(block: compat.Animated) -> None:
    """Raise InputError if the keyframes of an object or of shape keys cannot be changed."""
    action = block.animation_data and block.animation_data.action
    if action and (action.library or action.override_library):
        raise InputError(f"The action '{action.name}' is linked; make it local first.")


def _require_local(obj: bpy.types.Object, chain: Chain) -> Control:
    control = control_of(obj, chain)
    if control.owner.library is not None:
        name = control.owner.name
        raise InputError(f"'{name}', which has the slider '{chain.slider}', is linked; make it local first.")
    return control


@contextmanager
def chain_written(
    obj: bpy.types.Object,
    chain: Chain,
    shapes: dict[int, NDArray[np.float32]],
    steps: Steps,
    keyframes: tuple[int, ...] | None,
    via_at: tuple[float, ...] = (),
) -> Iterator[tuple[ExitStack, list[str]]]:
    """Write the shapes of a chain into shape keys that one control plays; undo everything if that or the block fails.

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
        Frames of the control's keyframes, at the first and the last key or at each; None for none.
    via_at
        Places of the inner keys; needed for keyframes at each.

    Yields
    ------
    undo : ExitStack
        Undoes everything if the block fails; the block may add to it.
    notes : list of str
        Sentences for the user.

    Raises
    ------
    InputError
        If a key or action cannot be written, or the slider is no longer a number.
    """
    require_writable(obj, chain, keyframes)
    keys, control = keys_of(obj), control_of(obj, chain)
    base = base_key(keys, chain)
    owned = owned_keys(keys, chain)
    kept = _kept(chain, owned, steps.places, shapes)
    stale = [key for key in owned.values() if key not in kept.values()]
    active = obj.active_shape_key
    curve: bpy.types.FCurve | None = None
    wanted: slider.Keyframes = ()
    notes: list[str] = []
    with ExitStack() as undo:
        undo.callback(_activate, obj, active)
        if isinstance(control.owner, bpy.types.Object):
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
            written[step] = new_key(obj, names.key_name(chain.slider, step, steps.places), base, undo)
            set_key_coordinates(written[step], shapes[step])
            drivers.drive_value(written[step], control, weights, step)
        if keyframes is not None:
            wanted = keyframe_values(keyframes, via_at)
            curve, notes = slider.begin_keyframes(control, chain, wanted, undo)
        notes = [*notes, *_staying(keys, stale)[1]]  # before the notes are stored; they are removed afterward
        chain.keys = {step: written[step].name for step in sorted(written)}
        chain.keyframes = chain.keyframes if curve is None else keyframes
        yield undo, notes
        undo.pop_all()
    # Nothing below can fail for a reason that was not checked before anything was written.
    _let_play(kept, control, weights)
    if curve is not None:
        slider.set_keyframes(curve, wanted)
    remove_keys(obj, stale)


def _let_play(kept: dict[int, bpy.types.ShapeKey], control: Control, weights: Weights) -> None:
    """Give keys of an earlier bake the weights of this one."""
    for step, key in kept.items():
        if (key.slider_min, key.slider_max) == (0.0, 1.0):  # otherwise the user chose the range
            _widen(key)
        drivers.drive_value(key, control, weights, step)


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


def remove_keys(obj: bpy.types.Object, stale: list[bpy.types.ShapeKey]) -> list[str]:
    """Remove shape keys with their drivers; the active key stays active where it is not one of them.

    Returns
    -------
    list of str
        Sentences about keys that stay, with value 0, because drivers of the user read them, and about keyframes of the
        others.
    """
    active = None if obj.active_shape_key in stale else obj.active_shape_key
    staying, notes = _staying(keys_of(obj), stale)
    for key in stale:
        if key.name in staying:
            drivers.undrive(key)
            key.value, key.slider_min, key.slider_max = 0.0, 0.0, 1.0  # an ordinary key of the user
        else:
            _remove_key(obj, key)
    _activate(obj, active)
    keys_of(obj).update_tag()
    return notes


def _staying(keys: bpy.types.Key, stale: list[bpy.types.ShapeKey]) -> tuple[set[str], list[str]]:
    """Which of these keys stay when they are removed, and sentences about them and about keyframes without a key."""
    staying, notes = set(), []
    read = drivers.paths_read(keys) if stale else {}
    for key in stale:
        readers = sum(count for path, count in read.items() if path.startswith(key_path(key.name)))
        if readers:
            staying.add(key.name)
            what = "driver reads" if readers == 1 else "drivers read"
            notes.append(f"Key '{key.name}' stays, with value 0, since {readers} {what} it.")
        elif compat.is_animated(keys, value_path(key.name)):
            notes.append(f"The keyframes of '{key.name}', which is gone, stay in the action without effect.")
    return staying, notes


def remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    """Remove a shape key without a driver; the active key stays active unless it is this one."""
    active = None if obj.active_shape_key == key else obj.active_shape_key
    obj.shape_key_remove(key)
    _activate(obj, active)


def new_key(obj: bpy.types.Object, name: str, base: bpy.types.ShapeKey, undo: ExitStack) -> bpy.types.ShapeKey:
    """A key relative to another one, at 0, whose value may leave 0 to 1; closing ``undo`` removes it."""
    key = obj.shape_key_add(name=name, from_mix=False)
    undo.callback(_remove_key, obj, key)
    key.value = 0.0  # Blender 5 starts with 1
    _widen(key)
    key.relative_key = base
    return key


def _widen(key: bpy.types.ShapeKey) -> None:
    """Widen a key's range to Blender's maximum: smooth weights exceed [0, 1]."""
    key.slider_min, key.slider_max = RANGE


def _remove_key(obj: bpy.types.Object, key: bpy.types.ShapeKey) -> None:
    # Removing a key together with its driver leaves the driver in the dependency graph, and Blender crashes at the
    # next update; removing the driver first has the graph rebuilt.
    drivers.undrive(key)
    obj.shape_key_remove(key)


def _activate(obj: bpy.types.Object, key: bpy.types.ShapeKey | None) -> None:
    obj.active_shape_key_index = 0 if key is None else keys_of(obj).key_blocks.find(key.name)
