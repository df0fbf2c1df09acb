# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the pairs of an object's keys that need a combination; kept for the panel while Blender runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import bpy

from ...solver.errors import InputError
from ..bake.many import bakeable_keys
from ..keys.sides import whole_of
from ..kinds import keys_of, mesh_of
from ..store import checks
from ..store.mesh_data import key_coordinates, shown_coordinates, triangles, wire_edges


@dataclass(frozen=True)
class PairVerdict:
    """Whether two keys simply add up.

    Parameters
    ----------
    outer, inner : str
        Names of the keys; the outer one carries the other along.
    adding_is_right : bool
        Whether their sum is right.
    distance : float
        Estimated error of the sum, over the size.
    text : str
        The verdict in words.
    """

    outer: str
    inner: str
    adding_is_right: bool
    distance: float
    text: str


_found: dict[int, list[PairVerdict]] = {}


def judge(obj: bpy.types.Object | None) -> Iterator[float]:
    """Judge every pair of the object's keys with the same base; yields the fraction that is done.

    Generated keys are skipped. ``found`` returns the verdicts afterward.

    Raises
    ------
    InputError
        If the object has no two such keys, or keys cannot be used.
    """
    from ...solver.combinations.base import KeysOnBase
    from ...solver.combinations.verdicts import verdicts

    obj = checks.require_object(obj)
    keys = keys_of(obj)
    by_base: dict[str, list[str]] = {}
    for name in bakeable_keys(obj):
        by_base.setdefault(keys.key_blocks[name].relative_key.name, []).append(name)
    groups = {base: names for base, names in by_base.items() if len(names) > 1}
    if not groups:
        raise InputError(f"'{obj.name}' has no two keys that could be on at once; add some.")
    every = sum(len(list(combinations(names, 2))) for names in groups.values())
    results = []
    for base, names in groups.items():
        # What a key adds to what it is relative to, as far as its vertex group lets it.
        start = key_coordinates(obj, base)
        whole = [shown_coordinates(obj, name) for name in names]
        shapes = KeysOnBase(start, whole, triangles(mesh_of(obj)), wire_edges(mesh_of(obj)))
        for verdict in verdicts(shapes):
            inner = verdict.second if verdict.outer == verdict.first else verdict.first
            pair = names[verdict.outer], names[inner]
            is_right, text = verdict.adding_is_right, verdict.text
            if not is_right and (of_both := whole_of(obj, pair)) is not None:
                is_right, text = True, f"adding is right: they are the sides of {of_both}"
            results.append(PairVerdict(*pair, is_right, verdict.distance, text))
            yield len(results) / every
    _found[keys.session_uid] = sorted(results, key=lambda one: (one.adding_is_right, -one.distance))


def found(obj: bpy.types.Object) -> list[PairVerdict]:
    """The verdicts on the object's pairs of keys, those that need a combination first; empty before ``judge``."""
    keys = keys_of(obj)
    blocks = keys.key_blocks
    return [one for one in _found.get(keys.session_uid, []) if one.outer in blocks and one.inner in blocks]
