# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Splits the in-betweens of a key among the keys for its two sides, so that both together show the same motion."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ..bake import bookkeeping
from ..keys import chain_keys, shape_keys, sides
from ..keys.sculpted import Sculpted
from ..kinds import keys_of
from ..store import names
from ..store.chain import Chain
from ..store.mesh_data import key_coordinates
from ..store.records import Record
from ..store.renames import digest


def split_in_betweens(obj: bpy.types.Object, record: Record, chain: Chain, both: Sequence[str]) -> list[str]:
    """Give the keys for both sides of a key their shares of its in-betweens, at the same values.

    In-betweens that a side has already are replaced, except what was sculpted into them.

    Parameters
    ----------
    chain
        The in-betweens of the key, which its value plays.
    both
        Names of the keys for its sides, which add up to it.

    Returns
    -------
    list of str
        Sentences for the user.

    Raises
    ------
    InputError
        If in-betweens of the key are missing, or keys cannot be written. A side that is finished by then is kept.
    """
    keys = keys_of(obj)
    owned = chain_keys.all_owned_keys(keys, chain)
    base = chain_keys.base_key(keys, chain).name
    start = key_coordinates(obj, base).astype(np.float64)
    offsets = {step: key_coordinates(obj, key.name) - start for step, key in owned.items()}
    request = {**chain.request, "via_at": []} if chain.request else {}
    places = shape_keys.Steps(chain.places, chain.corners)
    notes: list[str] = []
    for name in both:
        share = sides.shares(obj, chain.on_key, name)[:, None]
        shapes = {step: (start + share * offset).astype(np.float32) for step, offset in offsets.items()}
        side = record.chain_on_key(name)
        if side is None:
            taken = {*obj.keys(), *(other.slider for other in record.chains)}
            side = Chain((base, name), names.chain_label((name,), taken), on_key=name)
            record.chains.append(side)
        sculpted = Sculpted.of(obj, side)
        sculpted.require_among(chain.places)
        shapes, made, kept = sculpted.kept(chain.places, shapes)
        with shape_keys.chain_written(obj, side, shapes, places, None) as (undo, said):
            side.through, side.request, side.result, side.mirror_of = (base, name), request, None, ""
            side.digests = tuple(digest(keys.key_blocks[known]) for known in side.through)
            bookkeeping.remember(obj, record, side, None, made, undo)
        notes += [*said, *kept]
    return notes
