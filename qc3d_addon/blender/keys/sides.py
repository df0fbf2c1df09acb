# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys for the two sides of a face, and the key that both add up to."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ...solver.arrays import Floats
from ..kinds import keys_of
from ..store.mesh_data import key_coordinates, shown_coordinates

_SAME = 1e-5  # relative to the size: what splitting in single precision, or in another program, leaves


def sides_of(obj: bpy.types.Object, name: str) -> tuple[str, str] | None:
    """Names of two keys that flip to each other, such as Smile.L and Smile.R, and add up to a key; None if none do."""
    keys = keys_of(obj)
    for one in keys.key_blocks:
        other = bpy.utils.flip_name(one.name)
        if one.name < other and other in keys.key_blocks and whole_of(obj, (one.name, other)) == name:
            return one.name, other
    return None


def whole_of(obj: bpy.types.Object, names: Sequence[str]) -> str | None:
    """Name of the key that two keys for different sides add up to, all relative to the same; None if there is none."""
    keys = keys_of(obj)
    blocks = [keys.key_blocks[name] for name in names]
    if len(blocks) != 2 or bpy.utils.flip_name(names[0]) != names[1] or names[0] == names[1]:
        return None
    base = blocks[0].relative_key
    if blocks[1].relative_key != base:
        return None
    added = moved(obj, names[0]) + moved(obj, names[1])
    nearly = _SAME * max(float(np.ptp(key_coordinates(obj, base.name), axis=0).max(initial=0.0)), _largest(added))
    wholes = (key for key in keys.key_blocks if key not in (*blocks, base) and key.relative_key == base)
    for key in wholes:
        whole = moved(obj, key.name)
        if _largest(whole) > nearly and _largest(whole - added) <= nearly:
            return key.name
    return None


def moved(obj: bpy.types.Object, name: str) -> Floats:
    """(n, 3) what a key, fully on, adds to the one that it is relative to."""
    base = keys_of(obj).key_blocks[name].relative_key
    return shown_coordinates(obj, name).astype(np.float64) - key_coordinates(obj, base.name)


def shares(obj: bpy.types.Object, whole: str, side: str) -> Floats:
    """(n,) how much of a key is in the key for one of its sides, from 0 to 1.

    Where the key moves nothing, that is 1 on the side, 0 on the other and a half between them.
    """
    all_of_it, part = moved(obj, whole), moved(obj, side)
    lengths = (all_of_it**2).sum(axis=1)
    rest = key_coordinates(obj, keys_of(obj).reference_key.name)[:, 0].astype(np.float64)
    towards = np.sign((rest * (part**2).sum(axis=1)).sum())
    found = 0.5 + 0.5 * np.sign(rest) * towards
    moves = lengths > (_SAME * np.sqrt(lengths.max(initial=0.0))) ** 2
    found[moves] = (all_of_it * part).sum(axis=1)[moves] / lengths[moves]
    return np.asarray(np.clip(found, 0.0, 1.0))


def _largest(offsets: Floats) -> float:
    return float(np.abs(offsets).max(initial=0.0))
