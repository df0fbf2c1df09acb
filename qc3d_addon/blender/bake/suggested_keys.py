# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Suggests keys if none are chosen. Fast enough for a panel."""

from __future__ import annotations

import re
from collections.abc import Sequence

import bpy

from ...solver.errors import InputError
from ..keys.leftovers import leftovers
from ..kinds import shape_keys_of
from ..store import combined_keys
from ..store.chain import Chain
from ..store.records import Record

# Riggers and other programs name sculpted in-betweens by the key's name and a percentage, perhaps with a separator.
# One digit is rather the number of a version.
_PERCENTAGE = re.compile(r"[_. ]?(\d{2})")
_ROUNDING = 0.01  # tolerance for places in whole percents, rounded or truncated


def suggested_keys(obj: bpy.types.Object, first: str, last: str) -> tuple[str, str]:
    """The first and the last key, with empty names replaced by suggestions.

    The suggestion for the last key is the active key, or the key whose in-between is active; that for the first is the
    base of the last. A name stays empty if there is no suggestion.
    """
    keys = shape_keys_of(obj) if obj.type == 'MESH' else None
    if keys is None or not keys.use_relative or (first and last):
        return first, last
    if not last:
        active = _active_key(obj, keys)
        last = active if active != first else ""
    if not first:
        key = keys.key_blocks.get(last)
        base = (keys.reference_key if key is None else key.relative_key).name
        first = base if base != last else ""
    return first, last


def sculpted_between(obj: bpy.types.Object, last: str) -> dict[str, float]:
    """The user's own keys that are named like in-betweens of a key, such as "Smile_25" and "Smile_60".

    Returns
    -------
    dict
        The places, between 0 and 1, that the names say, by name and in their order; of several names for one place,
        the first.
    """
    keys = shape_keys_of(obj) if obj.type == 'MESH' else None
    if keys is None or not last:
        return {}
    recorded = made_keys(keys)
    made = {*recorded, *leftovers(keys, recorded)}
    places: dict[float, str] = {}
    for key in keys.key_blocks:
        if key.name.startswith(last) and key.name not in made:
            found = _PERCENTAGE.fullmatch(key.name[len(last) :])
            if found is not None and int(found[1]) > 0:
                places.setdefault(int(found[1]) / 100.0, key.name)
    return {places[place]: place for place in sorted(places)}


def are_even(places: Sequence[float]) -> bool:
    """Whether places between 0 and 1 are evenly spaced, as far as whole percents can tell."""
    evenly = [number / (len(places) + 1) for number in range(1, len(places) + 1)]
    return all(abs(place - even) <= _ROUNDING for place, even in zip(places, evenly, strict=True))


def _active_key(obj: bpy.types.Object, keys: bpy.types.Key) -> str:
    """The active key, or the one that it is an in-between of; with two keys only, the second."""
    key = obj.active_shape_key
    if key is None or key == keys.reference_key:
        own = [other.name for other in keys.key_blocks if other.name not in made_keys(keys)]
        return own[1] if len(own) == 2 else ""
    made = made_keys(keys)
    chain = made.get(key.name)
    if chain is not None:
        return chain.through[-1] if chain.through[-1] in keys.key_blocks else ""
    return "" if key.name in made else key.name


def made_keys(keys: bpy.types.Key) -> dict[str, Chain | None]:
    """Names of the generated keys, with the chain of those that are in-betweens."""
    try:
        made: dict[str, Chain | None] = dict.fromkeys(combined_keys.names_made(keys))
        for chain in Record.read(keys).chains:
            made.update(dict.fromkeys(chain.keys.values(), chain))
    except InputError:  # the panel says what is wrong with the record
        return {}
    return made
