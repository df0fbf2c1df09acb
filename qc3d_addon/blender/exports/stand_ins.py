# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys that stand in for sliders while an object is exported: other programs know in-betweens of keys only."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager

import bpy
import numpy as np

from .. import compat
from ..keys import chain_keys, chain_shapes, drivers, shape_keys
from ..keys.control import value_path
from ..kinds import keys_of, present
from ..store.chain import Chain
from ..store.mesh_data import set_key_coordinates


@contextmanager
def playing_keys(obj: bpy.types.Object, chains: Sequence[Chain]) -> Iterator[list[str]]:
    """Names of keys whose values play the chains, one for each, during the block.

    For a chain with a slider it is a new key, which the slider drives and which shows the way from the first key of the
    chain to the last. If the first key is not the Basis, another new key, fully on, shows that key. Both are gone
    after the block.

    Raises
    ------
    InputError
        If keys of a chain or its slider are missing.
    """
    keys = keys_of(obj)
    with ExitStack() as undo:
        undo.callback(setattr, obj, "active_shape_key_index", obj.active_shape_key_index)
        names = []
        for chain in chains:
            if chain.on_key:
                names.append(chain.on_key)
                continue
            control = chain_keys.control_of(obj, chain)
            control.require()
            shapes = chain_shapes.step_shapes(obj, chain)
            base = chain_keys.base_key(keys, chain)
            start = np.empty(3 * len(base.points), dtype=np.float32)
            base.points.foreach_get("co", start)
            rest = start.reshape(-1, 3).astype(np.float64)
            if not np.array_equal(shapes[0], rest):
                first = shape_keys.new_key(obj, f"{chain.slider}_start", base, undo)
                set_key_coordinates(first, shapes[0].astype(np.float32))
                first.value = 1.0
            key = shape_keys.new_key(obj, chain.slider, base, undo)
            set_key_coordinates(key, (rest + shapes[-1] - shapes[0]).astype(np.float32))
            drivers.read(present(compat.new_driver(keys, value_path(key.name)).driver), control)
            names.append(key.name)
        keys.update_tag()
        yield names
