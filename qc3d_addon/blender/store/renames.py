# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys of the user that were renamed since a bake: Blender lets drivers and curves follow, and so does the record."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence

import bpy
import numpy as np

_VALUE = re.compile(r'key_blocks\["(.*)"\]\.value', re.DOTALL)


def digest(key: bpy.types.ShapeKey) -> str:
    """A short text that tells the shape of a key from others."""
    values = np.empty(3 * len(key.points), dtype=np.float32)
    key.points.foreach_get("co", values)
    return hashlib.sha256(values.tobytes()).hexdigest()[:16]


def renamed(
    keys: bpy.types.Key, through: Sequence[str], digests: Sequence[str], on_key: str, made: Iterable[str]
) -> dict[str, str]:
    """The names that keys of a chain have now, by those that they had, where that can be told.

    The key that plays a chain is the one that the chain's drivers read, and what it is relative to is known from
    itself. Any other is the one key that has the shape which it had at the bake. Quick where no key is missing.

    Parameters
    ----------
    through, digests, on_key
        As ``Chain`` has them.
    made
        Names of the keys that the chain's bake made.
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
    """Name of the key whose value the drivers of made keys read; None where there is none."""
    if keys.animation_data is None:
        return None
    for name in made:
        curve = keys.animation_data.drivers.find(f'key_blocks["{bpy.utils.escape_identifier(name)}"].value')
        variables = [] if curve is None or curve.driver is None else list(curve.driver.variables)
        if len(variables) != 1 or variables[0].type != 'SINGLE_PROP':
            continue
        match = _VALUE.fullmatch(variables[0].targets[0].data_path)
        read = None if match is None else bpy.utils.unescape_identifier(match[1])
        if read is not None and read in keys.key_blocks:
            return str(read)
    return None
