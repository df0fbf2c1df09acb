# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether an object can be baked at all, and the sentence to say where it cannot."""

from __future__ import annotations

import bpy

from ..solver.errors import InputError


def object_problem(obj: bpy.types.Object | None) -> str | None:
    """Why nothing can be baked on ``obj``, or None. Quick enough for a button that is drawn all the time."""
    if obj is None:
        return "There is no active object; select a mesh with shape keys."
    if obj.type != 'MESH':
        return f"'{obj.name}' is not a mesh; select a mesh with shape keys."
    mesh, keys = obj.data, obj.data.shape_keys
    for block in (obj, mesh, keys):
        if block is None:
            continue
        if block.library is not None:
            return f"'{block.name}' is linked from a library and cannot be changed; make it local first."
        if block.override_library is not None:
            return f"'{block.name}' is a library override and cannot take new shape keys; make it local first."
    if obj.mode != 'OBJECT' or mesh.is_editmode:
        return f"'{obj.name}' is being edited; go back to Object Mode first."
    if keys is None or len(keys.key_blocks) < 2:
        return f"'{obj.name}' has fewer than two shape keys; add a second one to go to."
    if not keys.use_relative:
        return f"The shape keys of '{obj.name}' are absolute; switch on Relative, which the slider needs."
    return None


def require_object(obj: bpy.types.Object | None) -> bpy.types.Object:
    """``obj`` itself where it can be baked; raises InputError where it cannot."""
    problem = object_problem(obj)
    if problem is not None:
        raise InputError(problem)
    assert obj is not None
    return obj


def pair_problem(keys: bpy.types.Key, from_key: str, to_key: str) -> str | None:
    """Why two names are not two shape keys of ``keys``, or None."""
    for name, which in ((from_key, "first"), (to_key, "second")):
        if not name:
            return f"Choose the {which} key."
        if name not in keys.key_blocks:
            return f"There is no shape key '{name}'; choose the {which} key from those of the mesh."
    if from_key == to_key:
        return f"'{from_key}' is both the first and the second key; choose two different keys."
    return None


def require_pair(keys: bpy.types.Key, from_key: str, to_key: str) -> None:
    """Raise InputError unless two names are two shape keys of ``keys``."""
    problem = pair_problem(keys, from_key, to_key)
    if problem is not None:
        raise InputError(problem)
