# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Splits a key for both sides of a face into one for each side, which add up to it."""

from __future__ import annotations

import bpy
import numpy as np

from ...solver.errors import InputError
from ..kinds import keys_of
from ..store import checks
from ..store.mesh_data import key_coordinates, set_key_coordinates


def split_key(obj: bpy.types.Object, name: str, falloff: float) -> tuple[str, str]:
    """Add the keys for the left and the right side of a key; returns their names.

    The left side has positive x, as Blender names sides. Where the absolute value of x is below the falloff, one side
    fades into the other, so that both add up to the key.

    Parameters
    ----------
    name
        Name of the key, which must not end in a side such as ".L".
    falloff
        Half the width of the transition, in the object's own units; 0 or more.

    Raises
    ------
    InputError
        If there is no such key, it is the Basis, has a side in its name, or the names are taken; nothing was changed.
    """
    keys = keys_of(obj)
    checks.require_keys(keys, [name])
    key = keys.key_blocks[name]
    if key == keys.reference_key:
        raise InputError(f"'{name}' is the Basis, which has no sides; choose another key.")
    if bpy.utils.flip_name(name) != name:
        raise InputError(f"'{name}' is of one side already; choose a key of both.")
    names = f"{name}.L", f"{name}.R"
    for taken in names:
        if taken in keys.key_blocks:
            raise InputError(f"There is a key '{taken}' already; rename or delete it first.")
    rest = key_coordinates(obj, keys.reference_key.name)[:, 0].astype(np.float64)
    width = max(falloff, float(np.finfo(np.float32).tiny))
    along = np.clip(0.5 + 0.5 * rest / width, 0.0, 1.0)
    left = (along * along * (3.0 - 2.0 * along))[:, None]
    base = key_coordinates(obj, key.relative_key.name).astype(np.float64)
    moved = key_coordinates(obj, name) - base
    for side, weight in zip(names, (left, 1.0 - left), strict=True):
        made = obj.shape_key_add(name=side, from_mix=False)
        set_key_coordinates(made, (base + weight * moved).astype(np.float32))
        made.relative_key, made.vertex_group, made.value = key.relative_key, key.vertex_group, 0.0
        made.slider_min, made.slider_max = key.slider_min, key.slider_max
    return names
