# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A chain for the other side of a symmetric mesh."""

from __future__ import annotations

import bpy
import numpy as np

from ..solver.errors import InputError
from . import names, shape_keys
from .mesh_data import key_coordinates
from .records import Chain, Record


def mirror_chain(obj: bpy.types.Object, record: Record, chain: Chain) -> Chain:
    """Make the mirror image of a chain, with its own keys and slider; one made before is brought up to date.

    Every vertex goes where the mirror image of its partner goes, bit for bit. The sides in the keys' names, such as
    ".L", are flipped; names without a side get "mirrored" behind them.

    Raises
    ------
    InputError
        If the Basis is not symmetric across x = 0, or keys cannot be written; nothing was changed.
    """
    from ..solver.symmetry import mirror_partners

    keys = obj.data.shape_keys
    steps = shape_keys.owned_keys(keys, chain)
    if set(steps) != set(chain.keys):
        raise InputError(f"Shape keys of '{chain.slider}' were deleted; re-bake it first.")
    rest = key_coordinates(obj, keys.reference_key.name)
    ends = np.empty(2 * len(obj.data.edges), dtype=np.int32)
    obj.data.edges.foreach_get("vertices", ends)
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
    shape_keys.require_writable(obj, mirrored, None)
    shape_keys.write_chain(obj, mirrored, shapes, chain.intervals, None)
    mirrored.request = chain.request
    record.write(keys)
    return mirrored


def _other_side(name: str, basis: str) -> str:
    return name if name == basis else bpy.utils.flip_name(name)
