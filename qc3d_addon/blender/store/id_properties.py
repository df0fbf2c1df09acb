# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Custom properties that are written so that it can be taken back: the caller's ``undo`` puts back what was there."""

from __future__ import annotations

from contextlib import ExitStack

import bpy


def has(block: bpy.types.bpy_struct, name: str) -> bool:
    """Whether there is a custom property of that name. Quick enough for a panel."""
    return name in block  # type: ignore[operator]  # Blender looks a name up; the stubs do not know


def put(block: bpy.types.ID, name: str, value: str | bytes, undo: ExitStack) -> None:
    """Set a custom property; closing ``undo`` gives it the value again that it had, or removes it."""
    remove(block, name, undo)
    undo.callback(block.pop, name, None)
    block[name] = value


def remove(block: bpy.types.ID, name: str, undo: ExitStack) -> None:
    """Remove a custom property, if it is there; closing ``undo`` puts it back."""
    # Blender cuts bytes at their first zero where they overwrite bytes; a new property keeps them whole.
    if has(block, name):
        undo.callback(block.__setitem__, name, _plain(block[name]))
        del block[name]


def _plain(value: object) -> object:
    """A value that stays when its property is gone: groups and arrays are views of it."""
    for convert in ("to_dict", "to_list"):
        if hasattr(value, convert):
            return getattr(value, convert)()
    return [_plain(part) for part in value] if isinstance(value, list) else value
