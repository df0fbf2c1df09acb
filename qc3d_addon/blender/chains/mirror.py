# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A chain for the other side of a symmetric mesh."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from ..bake import bookkeeping
from ..keys import shape_keys
from ..kinds import keys_of, mesh_of
from ..store import kept_measures, names
from ..store.mesh_data import key_coordinates
from ..store.records import Chain, Record
from ..store.summaries import Summary


def mirror_chain(obj: bpy.types.Object, record: Record, chain: Chain) -> Chain:
    """Make the mirror image of a chain, with its own keys and slider; one made before is brought up to date.

    Every vertex goes where the mirror image of its partner goes, bit for bit. The sides in the keys' names, such as
    ".L", are flipped; names without a side get "mirrored" behind them.

    Raises
    ------
    InputError
        If the Basis is not symmetric across x = 0, the chain is a mirror image itself, the other side was baked from
        keys of its own, or keys cannot be written; nothing was changed.
    """
    from ...solver.triangles.mirror_symmetry import mirror_partners

    if chain.mirror_of:
        raise InputError(f"'{chain.slider}' is the mirror image of '{chain.mirror_of}' itself; choose that one.")
    keys = keys_of(obj)
    steps = shape_keys.all_owned_keys(keys, chain)
    rest = key_coordinates(obj, keys.reference_key.name)
    ends = np.empty(2 * len(mesh_of(obj).edges), dtype=np.int32)
    mesh_of(obj).edges.foreach_get("vertices", ends)
    partners = mirror_partners(rest.astype(np.float64), ends.reshape(-1, 2).astype(np.int64))
    flipped = np.array([-1.0, 1.0, 1.0], dtype=np.float32)
    shapes = {step: key_coordinates(obj, key.name)[partners] * flipped for step, key in steps.items()}

    through = tuple(_other_side(name, keys.reference_key.name) for name in chain.through)
    if through == chain.through:
        through = (*through[:-1], f"{through[-1]} mirrored")
    mirrored = record.chain(through)
    if mirrored is None:
        taken = {*obj.keys(), *(other.slider for other in record.chains)}
        mirrored = Chain(through, names.chain_label(through, taken))
        record.chains.append(mirrored)
    elif mirrored.result and not mirrored.mirror_of:
        raise InputError(
            f"'{mirrored.slider}' was baked from keys of its own; remove it before it is made from '{chain.slider}'."
        )
    measures = kept_measures.read(keys, chain.slider, len(partners))
    with shape_keys.chain_written(obj, mirrored, shapes, chain.intervals, None) as (undo, _):
        mirrored.request, mirrored.mirror_of = chain.request, chain.slider
        mirrored.result = _mirrored_result(chain.result, partners)
        if measures is not None:
            measures = {name: values[:, partners] for name, values in measures.items()}
        bookkeeping.remember(obj, record, mirrored, measures, undo)
    return mirrored


def _mirrored_result(result: Summary | None, partners: NDArray[np.int64]) -> Summary | None:
    """What the panel shows of the mirror image: the same, at the partner of the worst place."""
    if result is None or result.worst is None or result.worst.vertex >= len(partners):
        return result
    return replace(result, worst=replace(result.worst, vertex=int(partners[result.worst.vertex])))


def _other_side(name: str, basis: str) -> str:
    return name if name == basis else bpy.utils.flip_name(name)
