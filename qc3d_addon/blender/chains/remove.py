# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes away what bakes made, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import bpy

from .. import compat
from ..heat_map import heat_map
from ..keys import shape_keys, slider
from ..store import kept_measures
from ..store.records import PROPERTY, Chain, Record


def remove_chain(obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
    """Remove a chain with its shape keys, drivers, slider, keyframes, and the maps that no other chain needs.

    Returns
    -------
    Sentences about what was left because the animator's own work depends on it.

    Raises
    ------
    InputError
        If a key is locked, or the slider's object is linked; nothing was removed.
    """
    shape_keys.require_writable(obj, chain, None)
    owner = shape_keys.slider_owner(obj, chain)
    shape_keys.remove_keys(obj, chain)
    forget_chain(obj, record, chain)
    return remove_slider(owner, chain)


def remove_slider(owner: bpy.types.Object, chain: Chain) -> list[str]:
    """Remove the slider of a chain, with the keyframes that a bake gave it; a sentence where something needs it."""
    if chain.slider not in owner:
        return []
    readers = sum(1 for curve in _drivers() if slider.reads(curve.driver, owner, chain.slider))
    if readers:
        what = "driver reads" if readers == 1 else "drivers read"
        return [f"The slider '{chain.slider}' stays, since {readers} {what} it."]
    path = slider.data_path(chain.slider)
    notes = []
    if compat.find_fcurve(owner, path) is not None:
        if chain.keyframes is not None:
            compat.remove_fcurve(owner, path)
        else:
            notes.append(f"The keyframes of '{chain.slider}' stay in the action of '{owner.name}', without effect.")
    del owner[chain.slider]
    owner.update_tag()
    return notes


def forget_chain(obj: bpy.types.Object, record: Record, chain: Chain) -> None:
    """Forget a chain: its entry in the record, its measures, its heat map, and the maps that no other chain needs."""
    keys = obj.data.shape_keys
    state = heat_map.shown(obj)
    if state is not None and state.slider == chain.slider:
        heat_map.hide(obj)
    kept_measures.forget(keys, chain.slider)
    record.chains.remove(chain)
    needed = {ends for other in record.chains for ends in pairwise(other.through)}
    for kept in [kept for kept in record.maps if (kept.from_key, kept.to_key) in set(pairwise(chain.through)) - needed]:
        record.maps.remove(kept)
        keys.pop(kept.property_name, None)
    if record.chains or record.maps:
        record.write(keys)
    else:
        keys.pop(PROPERTY, None)


def _drivers() -> Iterator[bpy.types.FCurve]:
    """All drivers of the file."""
    for collection in bpy.data.bl_rna.properties:
        if collection.type != 'COLLECTION':
            continue
        for block in getattr(bpy.data, collection.identifier):
            animation = getattr(block, "animation_data", None)
            if animation is not None:
                yield from animation.drivers
            tree = getattr(block, "node_tree", None)
            if tree is not None and tree.animation_data is not None:
                yield from tree.animation_data.drivers
