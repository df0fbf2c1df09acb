# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Made keys that came without their drivers and their record, as when Blender joins objects.

*Join* keeps the shape keys of all objects, but the drivers and the custom properties of the active one only.
"""

from __future__ import annotations

import re
from collections.abc import Container

import bpy

from .. import compat
from .control import value_path
from .shape_keys import RANGE

_MADE = re.compile(r".+_\d{2,3}(_\d)?(\.\d{3})?")


def leftovers(keys: bpy.types.Key, known: Container[str]) -> list[str]:
    """Names of keys with the range and the name of a made one that nothing drives. Fast enough for a panel.

    Parameters
    ----------
    known
        Names of the keys that the mesh's records list.
    """
    driven = set() if keys.animation_data is None else {curve.data_path for curve in keys.animation_data.drivers}
    return [
        key.name
        for key in keys.key_blocks
        if (key.slider_min, key.slider_max) == RANGE
        and _MADE.fullmatch(key.name) is not None
        and key.name not in known
        and value_path(key.name) not in driven
        and compat.find_fcurve(keys, value_path(key.name)) is None  # of Bake to Keyframes
    ]


def sentence(names: list[str]) -> str | None:
    """What to do about them, or None if there are none."""
    if not names:
        return None
    more = "" if len(names) == 1 else f" and {len(names) - 1} more"
    return (
        f"'{names[0]}'{more} look like in-betweens, but nothing plays them, as after objects were joined. Delete them "
        "and bake their keys again."
    )
