# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks whether an object can be baked; each returns or raises a sentence for the user."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import bpy

from ...solver.errors import InputError
from ..kinds import keys_of, mesh_of, shape_keys_of
from . import records
from .chain import Chain


def object_problem(obj: bpy.types.Object | None) -> str | None:
    """Why ``obj`` cannot be baked, or None. Fast enough for every redraw of a button."""
    if obj is None:
        return "There is no active object; select a mesh with shape keys."
    if obj.type != 'MESH':
        return f"'{obj.name}' is not a mesh; select a mesh with shape keys."
    mesh, keys = mesh_of(obj), shape_keys_of(obj)
    for block in (obj, mesh, keys):
        if block is None:
            continue
        if block.library is not None:
            return f"'{block.name}' is linked from a library and cannot be changed; make it local first."
        if block.override_library is not None:
            return f"'{block.name}' is a library override and cannot take new shape keys; make it local first."
    if obj.mode != 'OBJECT' or mesh.is_editmode:
        return f"'{obj.name}' is being edited; go back to Object Mode first."
    if mesh.users > 1:
        other = next((other for other in bpy.data.objects if other.data == mesh and other.mode != 'OBJECT'), None)
        if other is not None:
            return f"'{other.name}', which shares its mesh, is being edited; go back to Object Mode first."
    if keys is None or len(keys.key_blocks) < 2:
        return f"'{obj.name}' has fewer than two shape keys; add a second one."
    if not keys.use_relative:
        return f"The shape keys of '{obj.name}' are absolute; enable Relative, which in-betweens need."
    return None


def require_object(obj: bpy.types.Object | None) -> bpy.types.Object:
    """``obj`` itself if it can be baked; raises InputError otherwise."""
    problem = object_problem(obj)
    if problem is not None:
        raise InputError(problem)
    assert obj is not None
    return obj


def keys_problem(keys: bpy.types.Key, names: Sequence[str]) -> str | None:
    """Why no in-betweens can go through the keys of these names, in this order, or None."""
    for number, name in enumerate(names):
        which = _which(number, len(names))
        if not name:
            return f"Choose {which}."
        if name not in keys.key_blocks:
            return f"There is no shape key '{name}'; choose {which} from those of the mesh."
    for name, following in pairwise(names):
        if name == following and len(names) == 2:
            return f"'{name}' is both the first and the second key; choose two different keys."
        if name == following:
            return f"'{name}' comes twice in a row; choose different keys one after the other."
    return None


def chain_problem(keys: bpy.types.Key, chain: Chain) -> str | None:
    """Why a chain cannot be baked again, or None: keys that it goes through may be missing."""
    lost = next((name for name in chain.through if name not in keys.key_blocks), None)
    if lost is None:
        return None
    if chain.mirror_of:
        return f"'{chain.slider}' is the mirror image of '{chain.mirror_of}'; mirror that one again."
    return f"Shape key '{lost}' was renamed or deleted; restore its name to re-bake, or make a new bake."


def chains_problem(obj: bpy.types.Object) -> str | None:
    """Why ``obj`` has no in-betweens to work on, or None. Fast enough for every redraw of a button."""
    state = records.state(keys_of(obj))
    if state.problem is None and not state.chains:
        return f"'{obj.name}' has no in-betweens yet; bake some first."
    return state.problem


def require_keys(keys: bpy.types.Key, names: Sequence[str]) -> None:
    """Raise InputError unless in-betweens can go through the keys of these names."""
    problem = keys_problem(keys, names)
    if problem is not None:
        raise InputError(problem)


def control_problem(keys: bpy.types.Key, names: Sequence[str], base: str) -> str | None:
    """Why the value of the last of these keys cannot play in-betweens that start at ``base``, or None."""
    key = keys.key_blocks[names[-1]]
    if key == keys.reference_key:
        return f"'{key.name}' is the Basis, which has no value; set Play On to Slider."
    if key.relative_key.name != base:
        return (
            f"'{key.name}' is relative to '{key.relative_key.name}', not to '{base}'; start from that key, or set "
            "Play On to Slider."
        )
    return None


def require_control(keys: bpy.types.Key, names: Sequence[str], base: str) -> None:
    """Raise InputError if a base is named and the last of the keys cannot play in-betweens from it."""
    require_keys(keys, names)
    problem = control_problem(keys, names, base) if base else None
    if problem is not None:
        raise InputError(problem)


def _which(number: int, count: int) -> str:
    if number == 0:
        return "the first key"
    if number == count - 1:
        return "the second key" if count == 2 else "the last key"
    return f"inner key {number}"
