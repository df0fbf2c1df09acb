# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Data stored beside the shape keys of a chain: its entry in the record, its measures, shapes and maps."""

from __future__ import annotations

from contextlib import ExitStack
from itertools import pairwise

import bpy

from ..heat_map import heat_map
from ..keys.chain_keys import base_key
from ..kinds import keys_of
from ..store import id_properties, kept_measures, kept_shapes
from ..store.chain import Chain
from ..store.kept_measures import Measures
from ..store.kept_shapes import Shapes
from ..store.mesh_data import key_coordinates
from ..store.records import PROPERTY, Record


def remember(
    obj: bpy.types.Object, record: Record, chain: Chain, measures: Measures | None, shapes: Shapes, undo: ExitStack
) -> None:
    """Store the record and the measures and shapes of a chain whose keys were written; update a shown heat map.

    ``shapes`` are those that the bake computed, by place, without what was sculpted into them.
    """
    keys = keys_of(obj)
    kept_shapes.keep(keys, chain.slider, key_coordinates(obj, base_key(keys, chain).name), shapes, undo)
    if measures:
        kept_measures.keep(keys, chain.slider, measures, undo)
    else:
        kept_measures.forget(keys, chain.slider, undo)
    record.write(keys, undo)
    heat_map.refresh(obj, chain)


def forget(keys: bpy.types.Key, record: Record, chain: Chain, undo: ExitStack) -> None:
    """Remove the entry of a chain from the record, its measures and shapes, and the maps that no other chain needs."""
    kept_measures.forget(keys, chain.slider, undo)
    kept_shapes.forget(keys, chain.slider, undo)
    record.chains.remove(chain)
    needed = {ends for other in record.chains for ends in pairwise(other.through)}
    for kept in [kept for kept in record.maps if (kept.from_key, kept.to_key) in set(pairwise(chain.through)) - needed]:
        record.maps.remove(kept)
        id_properties.remove(keys, kept.property_name, undo)
    if record.chains or record.maps:
        record.write(keys, undo)
    else:
        id_properties.remove(keys, PROPERTY, undo)


def forget_all(obj: bpy.types.Object) -> None:
    """Remove all that is stored with the keys of ``obj``, damaged or not, and its heat map; keys and sliders stay."""
    keys = keys_of(obj)
    heat_map.hide(obj)
    with ExitStack() as undo:
        for name in [name for name in keys.keys() if name == PROPERTY or name.startswith(f"{PROPERTY}_")]:  # noqa: SIM118
            id_properties.remove(keys, name, undo)
        undo.pop_all()
