# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes the control of in-betweens from a slider to the value of the last key."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...solver.errors import InputError
from ..bake import bookkeeping
from ..keys import chain_shapes, shape_keys
from ..kinds import keys_of, mesh_of
from ..store import checks, kept_measures, names
from ..store.chain import Chain
from ..store.records import Record
from . import remove


def problem(obj: bpy.types.Object, chain: Chain) -> str | None:
    """Why the last key's value cannot play the in-betweens of a slider, or None. Fast enough for a panel."""
    keys = keys_of(obj)
    if chain.on_key:
        return f"The value of '{chain.on_key}' already plays them."
    return checks.chain_problem(keys, chain) or checks.control_problem(keys, chain.through, chain.through[0])


def play_on_key(obj: bpy.types.Object, record: Record, chain: Chain) -> tuple[Chain, list[str]]:
    """Play the in-betweens of a slider by the value of the last key instead; the shapes stay the same.

    Returns
    -------
    chain : Chain
        The new chain.
    notes : list of str
        Sentences about what stays because the user's own work depends on it.

    Raises
    ------
    InputError
        If the key cannot play them or already plays others, or something cannot be changed; nothing is changed then.
    """
    found = problem(obj, chain)
    if found is not None:
        raise InputError(found)
    keys, name = keys_of(obj), chain.through[-1]
    if record.chain_on_key(name) is not None:
        raise InputError(f"'{name}' already plays other in-betweens; remove those or these.")
    shape_keys.require_removable(obj, chain)
    shapes = chain_shapes.offsets_by_step(obj, chain.places, chain_shapes.step_shapes(obj, chain))
    label = names.chain_label((name,), {*obj.keys(), *(other.slider for other in record.chains)})
    measures = kept_measures.read(keys, chain.slider, len(mesh_of(obj).vertices))
    moved = replace(
        chain, slider=label, keys={}, keyframes=None, request={**chain.request, "play_on": "key"}, on_key=name,
        muted=(),
    )
    record.chains.append(moved)
    places = shape_keys.Steps(chain.places, chain.corners)
    with shape_keys.chain_written(obj, moved, shapes, places, None) as (undo, notes):
        made = {chain.places[step]: np.asarray(shape) for step, shape in shapes.items()}
        bookkeeping.remember(obj, record, moved, measures, made, undo)
    return moved, [*notes, *remove.remove_chain(obj, record, chain)]
