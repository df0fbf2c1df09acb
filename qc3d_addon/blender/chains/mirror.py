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
from ..keys import chain_keys, shape_keys
from ..store import kept_measures, names
from ..store.mesh_data import key_coordinates
from ..store.records import Chain, Record
from ..store.summaries import Summary

_SAME = 1e-4  # of the size: keys that were mirrored by other tools are rounded


def mirror_chain(obj: bpy.types.Object, record: Record, chain: Chain) -> Chain:
    """Make the mirror image of a chain, with keys of its own; one made before is brought up to date.

    What a key's value plays goes onto the value of the key that is its mirror image; anything else gets a slider.

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
    keys = obj.data.shape_keys
    steps = chain_keys.all_owned_keys(keys, chain)
    base = chain_keys.base_key(keys, chain).name
    rest = key_coordinates(obj, keys.reference_key.name)
    ends = np.empty(2 * len(obj.data.edges), dtype=np.int32)
    obj.data.edges.foreach_get("vertices", ends)
    partners = mirror_partners(rest.astype(np.float64), ends.reshape(-1, 2).astype(np.int64))
    flipped = np.array([-1.0, 1.0, 1.0], dtype=np.float32)
    shapes = {step: key_coordinates(obj, key.name)[partners] * flipped for step, key in steps.items()}

    through = tuple(_other_side(name, keys.reference_key.name) for name in chain.through)
    if through == chain.through:
        if chain.on_key:
            raise InputError(f"'{chain.on_key}' has no side in its name, such as .L; its mirror image is not known.")
        through = (*through[:-1], f"{through[-1]}_mirrored")
    on_key = through[-1] if chain.on_key else ""
    if on_key:
        shape = key_coordinates(obj, chain.on_key)[partners] * flipped
        _require_mirror_image(obj, on_key, shape, base)
    mirrored = record.chain_on_key(on_key) if on_key else record.chain(through)
    if mirrored is None:
        taken = {*obj.keys(), *(other.slider for other in record.chains)}
        mirrored = Chain(through, names.chain_label((on_key,) if on_key else through, taken), on_key=on_key)
        record.chains.append(mirrored)
    elif mirrored.result and not mirrored.mirror_of:
        raise InputError(
            f"'{mirrored.slider}' was baked from keys of its own; remove it before it is made from '{chain.slider}'."
        )
    measures = kept_measures.read(keys, chain.slider, len(partners))
    places = shape_keys.Steps(chain.places, chain.corners)
    with shape_keys.chain_written(obj, mirrored, shapes, places, None) as (undo, _):
        mirrored.request, mirrored.mirror_of = chain.request, chain.slider
        mirrored.result = _mirrored_result(chain.result, partners)
        if measures is not None:
            measures = {name: values[:, partners] for name, values in measures.items()}
        bookkeeping.remember(obj, record, mirrored, measures, undo)
    return mirrored


def _require_mirror_image(obj: bpy.types.Object, name: str, shape: NDArray[np.float32], base: str) -> None:
    """Raise InputError unless the key of that name has this shape and is relative to ``base``."""
    key = obj.data.shape_keys.key_blocks.get(name)
    if key is None:
        raise InputError(f"There is no key '{name}' for the mirror image; mirror the key first.")
    size = float(np.ptp(shape, axis=0).max())
    if key.relative_key.name != base or np.abs(key_coordinates(obj, name) - shape).max() > _SAME * size:
        raise InputError(f"'{name}' is not the mirror image of the other side's key; bake it by itself.")


def _mirrored_result(result: Summary | None, partners: NDArray[np.int64]) -> Summary | None:
    """What the panel shows of the mirror image: the same, at the partner of the worst place."""
    if result is None or result.worst is None or result.worst.vertex >= len(partners):
        return result
    return replace(result, worst=replace(result.worst, vertex=int(partners[result.worst.vertex])))


def _other_side(name: str, basis: str) -> str:
    return name if name == basis else bpy.utils.flip_name(name)
