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
from ..keys.sculpted import Sculpted
from ..kinds import keys_of
from ..store import kept_measures, names
from ..store.chain import Chain
from ..store.mesh_data import key_coordinates
from ..store.records import Record
from ..store.summaries import Summary
from .mirror_image import MirrorImage, mirror_image

_SAME = 1e-4  # relative to the size: other tools round when they mirror keys


def mirror_chain(
    obj: bpy.types.Object, record: Record, chain: Chain, use_topology: bool = False
) -> tuple[Chain, list[str]]:
    """Make the mirror image of a chain with its own keys, or update the one made before.

    If a key's value plays the chain, the value of the mirrored key plays the mirror image; otherwise a slider does.
    Every vertex follows the mirror image of its partner, bit for bit if the Basis is exactly symmetric. Vertices
    without a partner move like their surroundings on the other side; a returned sentence says so. The sides in the
    keys' names, such as ".L", are flipped; names without a side get the suffix "_mirrored".

    Raises
    ------
    InputError
        If the Basis is not nearly symmetric across x = 0, the chain is itself a mirror image, the other side was baked
        from its own keys, or keys cannot be written; nothing is changed then.
    """
    if chain.mirror_of:
        raise InputError(f"'{chain.slider}' is itself the mirror image of '{chain.mirror_of}'; choose that one.")
    keys = keys_of(obj)
    steps = chain_keys.all_owned_keys(keys, chain)
    base = chain_keys.base_key(keys, chain).name
    image = mirror_image(obj, use_topology)
    partners, notes = image.partners, image.note()
    shapes = {step: image.of(key_coordinates(obj, key.name)) for step, key in steps.items()}

    through = tuple(_other_side(name, keys.reference_key.name) for name in chain.through)
    if through == chain.through:
        if chain.on_key:
            raise InputError(f"'{chain.on_key}' has no side such as .L in its name; add one to mirror it.")
        through = (*through[:-1], f"{through[-1]}_mirrored")
    on_key = through[-1] if chain.on_key else ""
    if on_key:
        shape = image.of(key_coordinates(obj, chain.on_key))
        _require_mirror_image(obj, on_key, shape, base, image)
    mirrored = record.chain_on_key(on_key) if on_key else record.chain(through)
    if mirrored is None:
        taken = {*obj.keys(), *(other.slider for other in record.chains)}
        mirrored = Chain(through, names.chain_label((on_key,) if on_key else through, taken), on_key=on_key)
        record.chains.append(mirrored)
    elif mirrored.result and not mirrored.mirror_of:
        raise InputError(
            f"'{mirrored.slider}' was baked from its own keys; remove it before you mirror '{chain.slider}'."
        )
    measures = kept_measures.read(keys, chain.slider, len(partners))
    places = shape_keys.Steps(chain.places, chain.corners)
    sculpted = Sculpted.of(obj, mirrored)
    sculpted.require_among(chain.places)
    shapes, made, _ = sculpted.kept(chain.places, shapes)
    with shape_keys.chain_written(obj, mirrored, shapes, places, None) as (undo, said):
        mirrored.request, mirrored.mirror_of = chain.request, chain.slider
        mirrored.result = _mirrored_result(chain.result, partners)
        if measures is not None:
            measures = {name: values[:, partners] for name, values in measures.items()}
        bookkeeping.remember(obj, record, mirrored, measures, made, undo)
    return mirrored, [*notes, *said]


def _require_mirror_image(
    obj: bpy.types.Object, name: str, shape: NDArray[np.float32], base: str, image: MirrorImage
) -> None:
    """Raise InputError unless the key of that name has this shape and is relative to ``base``."""
    key = keys_of(obj).key_blocks.get(name)
    if key is None:
        raise InputError(f"There is no key '{name}' for the mirror image; mirror the key first.")
    size = float(np.ptp(shape, axis=0).max())
    missed = np.abs(key_coordinates(obj, name) - shape)[image.has_partner]
    if key.relative_key.name != base or missed.max() > _SAME * size:
        raise InputError(f"'{name}' is not the mirror image of the other side's key; bake it by itself.")


def _mirrored_result(result: Summary | None, partners: NDArray[np.int64]) -> Summary | None:
    """The result of the mirror image for the panel: the same, with the partner of the worst vertex."""
    if result is None or result.worst is None or result.worst.vertex >= len(partners):
        return result
    return replace(result, worst=replace(result.worst, vertex=int(partners[result.worst.vertex])))


def _other_side(name: str, basis: str) -> str:
    return name if name == basis else bpy.utils.flip_name(name)
