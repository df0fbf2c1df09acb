# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Before and after: while it is on, a control shows the straight blend of its keys, as if nothing had been baked.

Nothing is removed. The in-betweens are muted, and where a slider plays copies of the user's keys, these fade straight
into each other. What was done is kept with the shape keys, so undo and copies know of it; a saved file is
as without it.
"""

from __future__ import annotations

import contextlib
import json
from contextlib import ExitStack

import bpy
import numpy as np

from ...solver.errors import InputError
from .. import compat
from ..kinds import keys_of, present, shape_keys_of
from ..store import id_properties
from ..store import stored_values as stored
from ..store.chain import Chain
from ..store.names import MAX_STEPS
from ..store.records import Record
from . import drivers
from .chain_keys import all_owned_keys, control_of, owned_keys
from .control import mute_path, value_path

PROPERTY = "qc3d_straight"

_suspended: list[tuple[int, str]] = []  # objects and sliders, while the file is saved


def is_on(keys: bpy.types.Key, chain: Chain) -> bool:
    """Whether the straight blend is shown in place of the in-betweens. Quick enough for a panel."""
    return id_properties.has(keys, PROPERTY) and chain.slider in _state(keys)


def show(obj: bpy.types.Object, chain: Chain) -> None:
    """Show the straight blend in place of the in-betweens of a chain.

    Raises
    ------
    InputError
        If keys of the chain are missing, or a driver of them was edited, which could not be given back.
    """
    from ...solver.frames.weights import Weights

    keys, control = keys_of(obj), control_of(obj, chain)
    state = _state(keys)
    if chain.slider in state:
        return
    control.require()
    owned, met = all_owned_keys(keys, chain), _steps_of_keys(chain)
    blends = {step: number for number, step in enumerate(met) if step in owned}
    weights = chain.weights
    for step in blends:
        curve = _curve(keys, value_path(owned[step].name))
        if curve is None or not drivers.shows(curve, weights, step):
            raise InputError(f"The driver of '{owned[step].name}' was edited; re-bake, then compare.")
    muted, held = [], []
    for step, key in owned.items():
        if step in blends:
            continue
        curve = _curve(keys, mute_path(key.name))
        if curve is not None and not curve.mute:
            curve.mute = True
            held.append(step)
        if not key.mute:
            key.mute = True
            muted.append(step)
    if blends:
        straight = Weights.hats([chain.places[step] for step in met])
        for step, number in blends.items():
            drivers.drive_value(owned[step], control, straight, number)
    _write(keys, {**state, chain.slider: [muted, held]})


def hide(obj: bpy.types.Object, chain: Chain) -> None:
    """Show the in-betweens again, all that are still there; nothing happens where they are shown."""
    keys = keys_of(obj)
    state = _state(keys)
    muted, held = state.pop(chain.slider, [[], []])
    if not id_properties.has(keys, PROPERTY):
        return
    owned, met, weights = owned_keys(keys, chain), _steps_of_keys(chain), chain.weights
    for step in owned.keys() & set(met):
        drivers.drive_value(owned[step], control_of(obj, chain), weights, step)
    for step in owned.keys() & set(held):
        curve = _curve(keys, mute_path(owned[step].name))
        if curve is not None:
            curve.mute = False
    for step in owned.keys() & set(muted):
        owned[step].mute = False
    _write(keys, state)


def end() -> list[tuple[int, str]]:
    """Show all in-betweens of the file again; the numbers of the objects, and the sliders, that had them hidden."""
    found: list[tuple[int, str]] = []
    for keys in bpy.data.shape_keys:
        if not id_properties.has(keys, PROPERTY) or keys.library is not None:
            continue
        obj = next((obj for obj in bpy.data.objects if obj.type == 'MESH' and shape_keys_of(obj) == keys), None)
        with contextlib.suppress(InputError):  # a damaged record, which knows no bakes
            for chain in [] if obj is None else Record.read(keys).chains:
                if obj is not None and is_on(keys, chain):
                    hide(obj, chain)
                    found.append((obj.session_uid, chain.slider))
        keys.pop(PROPERTY, None)
    return found


def _steps_of_keys(chain: Chain) -> list[int]:
    """The steps at which a slider shows the user's keys; none where the key itself plays, and blends by itself."""
    from ...solver.frames.easing import uneased

    if chain.on_key:
        return []
    at_keys = uneased(np.linspace(0.0, 1.0, len(chain.through)), chain.easing)
    return sorted(set(np.abs(np.array(chain.places)[:, None] - at_keys).argmin(axis=0).tolist()))


def _curve(keys: bpy.types.Key, path: str) -> bpy.types.FCurve | None:
    return None if keys.animation_data is None else keys.animation_data.drivers.find(path)


def _state(keys: bpy.types.Key) -> dict[str, list[list[int]]]:
    """By slider: the steps that were muted, and those whose own driver of that is held meanwhile."""
    try:
        found = stored.parse(keys.get(PROPERTY, "{}"))
        return {
            stored.name(slider): [
                [stored.whole(step, 0, MAX_STEPS) for step in stored.plain_list(steps)]
                for steps in (stored.plain_list(lists)[0], stored.plain_list(lists)[1])
            ]
            for slider, lists in found.items()
        }
    except (ValueError, IndexError):
        return {}


def _write(keys: bpy.types.Key, state: dict[str, list[list[int]]]) -> None:
    with ExitStack() as undo:
        if state:
            id_properties.put(keys, PROPERTY, json.dumps(state), undo)
        else:
            id_properties.remove(keys, PROPERTY, undo)
        undo.pop_all()
    keys.update_tag()


@compat.persistent
def _before_save(*_: object) -> None:
    _suspended[:] = end()


@compat.persistent
def _after_save(*_: object) -> None:
    for number, slider in _suspended:
        obj = next((obj for obj in bpy.data.objects if obj.session_uid == number), None)
        with contextlib.suppress(InputError):
            chain = None if obj is None else Record.read(keys_of(obj)).chain_of_slider(slider)
            if chain is not None:
                show(present(obj), chain)
    _suspended.clear()


_HANDLERS = {"save_pre": _before_save, "save_post": _after_save, "save_post_fail": _after_save}


def register() -> None:
    """Keep it out of saved files."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Show all in-betweens again."""
    for name, handler in _HANDLERS.items():
        compat.remove_handler(getattr(bpy.app.handlers, name), handler)
    end()
