# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Custom properties, written so that the caller's ``undo`` restores their previous values."""

from __future__ import annotations

from contextlib import ExitStack

import bpy


def has(block: bpy.types.bpy_struct, name: str) -> bool:
    """Whether there is a custom property of that name. Fast enough for a panel."""
    return name in block  # type: ignore[operator]  # Blender supports "in"; the stubs lack it


def put(block: bpy.types.ID, name: str, value: str | bytes, undo: ExitStack) -> None:
    """Set a custom property; closing ``undo`` restores its previous value or removes it."""
    remove(block, name, undo)
    undo.callback(block.pop, name, None)
    block[name] = value


def remove(block: bpy.types.ID, name: str, undo: ExitStack) -> None:
    """Remove a custom property if it exists; closing ``undo`` restores it."""
    # Blender cuts bytes off at the first zero when they overwrite bytes; a new property stores all of them.
    if has(block, name):
        undo.callback(block.__setitem__, name, _plain(block[name]))
        del block[name]


def _plain(value: object) -> object:
    """A copy of a value that outlives its property: groups and arrays are only views of it."""
    for convert in ("to_dict", "to_list"):
        if hasattr(value, convert):
            return getattr(value, convert)()
    return [_plain(part) for part in value] if isinstance(value, list) else value
