# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds keys that the user has renamed since a bake: Blender updates drivers and F-curves, and QC3D its record."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence

import bpy
import numpy as np

_VALUE = re.compile(r'key_blocks\["(.*)"\]\.value', re.DOTALL)


def digest(key: bpy.types.ShapeKey) -> str:
    """A short hash of the shape of a key."""
    values = np.empty(3 * len(key.points), dtype=np.float32)
    key.points.foreach_get("co", values)
    return hashlib.sha256(values.tobytes()).hexdigest()[:16]


def renamed(
    keys: bpy.types.Key, through: Sequence[str], digests: Sequence[str], on_key: str, made: Iterable[str]
) -> dict[str, str]:
    """The new names of the renamed keys of a chain, by their old names, as far as they can be found.

    The key that plays a chain is the one that the chain's drivers read, and that key knows its base. Any other key is
    found by its shape, if exactly one key has the shape of the bake. Fast if no key is missing.

    Parameters
    ----------
    through, digests, on_key
        As in ``Chain``.
    made
        Names of the keys that the bake of the chain made.
    """
    blocks, made = keys.key_blocks, list(made)
    found: dict[str, str] = {}
    if on_key:
        read = _read(keys, made)
        if read is not None and read != on_key:
            found[on_key] = read
        control = blocks.get(read or on_key)
        if control is not None and through[0] not in blocks:
            found[through[0]] = control.relative_key.name
    for name, shape in zip(through, digests, strict=False):
        if name in blocks or name in found:
            continue
        known = {*through, *made}
        same = [key.name for key in blocks if key.name not in known and digest(key) == shape]
        if len(same) == 1:
            found[name] = same[0]
    return found


def _read(keys: bpy.types.Key, made: Iterable[str]) -> str | None:
    """Name of the key whose value the drivers of generated keys read; None if there is none."""
    if keys.animation_data is None:
        return None
    for name in made:
        curve = keys.animation_data.drivers.find(f'key_blocks["{bpy.utils.escape_identifier(name)}"].value')
        variables = [] if curve is None or curve.driver is None else list(curve.driver.variables)
        # Beside the value, at most whether the key is muted.
        if len(variables) not in (1, 2) or variables[0].type != 'SINGLE_PROP':
            continue
        match = _VALUE.fullmatch(variables[0].targets[0].data_path)
        read = None if match is None else bpy.utils.unescape_identifier(match[1])
        if read is not None and read in keys.key_blocks:
            return str(read)
    return None
