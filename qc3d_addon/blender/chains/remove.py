# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes what bakes made, and nothing else."""

from __future__ import annotations

from contextlib import ExitStack

import bpy

from .. import compat
from ..bake import bookkeeping
from ..heat_map import heat_map
from ..keys import chain_keys, drivers, own_keyframes, shape_keys
from ..keys.control import Control
from ..kinds import keys_of
from ..store.chain import Chain
from ..store.records import Record


def remove_chain(obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
    """Remove a chain with its shape keys, drivers, slider, keyframes, and the maps that no other chain needs.

    Returns
    -------
    list of str
        Sentences about what stays because the user's own work depends on it.

    Raises
    ------
    InputError
        If a key is locked, or the slider's object or its action is linked; nothing was removed.
    """
    control = shape_keys.require_removable(obj, chain)
    hide_heat_map(obj, chain)
    notes = shape_keys.remove_keys(obj, list(chain_keys.owned_keys(keys_of(obj), chain).values()))
    notes += remove_slider(control, chain)
    notes += own_keyframes.unmute(keys_of(obj), chain)
    with ExitStack() as undo:  # last, so that a chain whose removal was interrupted can be removed again
        bookkeeping.forget(keys_of(obj), record, chain, undo)
        undo.pop_all()
    return notes


def remove_slider(control: Control, chain: Chain) -> list[str]:
    """Remove the slider of a chain, with the keyframes of a bake; a sentence for whatever stays."""
    owner = control.owner
    if control.is_key or not control.is_there:  # a key is the user's own
        return []
    if not control.is_number:
        return [f"The custom property '{chain.slider}' of '{owner.name}' stays, since it is no longer a number."]
    readers = sum(1 for curve in drivers.all_drivers() if drivers.reads(curve.driver, control))
    if readers:
        what = "driver reads" if readers == 1 else "drivers read"
        return [f"The slider '{chain.slider}' stays, since {readers} {what} it."]
    path = control.path
    notes = []
    if owner.animation_data is not None and owner.animation_data.drivers.find(path) is not None:
        owner.driver_remove(path)  # it kept the slider where that of another object is
    if compat.find_fcurve(owner, path) is not None:
        if chain.keyframes is not None:
            compat.remove_fcurve(owner, path)
        else:
            notes.append(f"The keyframes of '{chain.slider}' stay in the action of '{owner.name}', without effect.")
    del owner[chain.slider]
    owner.update_tag()
    return notes


def hide_heat_map(obj: bpy.types.Object, chain: Chain) -> None:
    """Hide the heat map of a chain, where it is shown."""
    state = heat_map.shown(obj)
    if state is not None and state.slider == chain.slider:
        heat_map.hide(obj)
