# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of an object whose absolute shape keys are the steps of a chain, played by their evaluation time."""

from __future__ import annotations

from contextlib import ExitStack

import bpy

from .. import compat
from ..heat_map import heat_map
from ..keys import shape_keys, slider
from ..kinds import keys_of, mesh_of, shape_keys_of
from ..store import id_properties
from ..store.mesh_data import key_coordinates, set_key_coordinates
from ..store.records import Chain


def copy_with_absolute_keys(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object:
    """Make the copy beside the object, in its collections; the slider of the object plays it.

    Absolute keys are blended one after the other by a single number, without values of their own. They come in
    the order of the steps; the copy has no other keys.

    Raises
    ------
    InputError
        If a generated key was deleted, or the slider cannot play anything; nothing was made.
    """
    keys = keys_of(obj)
    owner = shape_keys.slider_owner(obj, chain)
    slider.require(owner, chain.slider)
    steps = shape_keys.all_owned_keys(keys, chain)
    rest = key_coordinates(obj, keys.reference_key.name)
    shapes = [
        key_coordinates(obj, steps[step].name) if step in steps else rest for step in range(chain.intervals + 1)
    ]
    with ExitStack() as undo:
        copy = copied(obj, undo)
        copy.name = mesh_of(copy).name = f"{obj.name} absolute"
        heat_map.hide(copy)  # which is the original's
        compat.clear_shape_keys(copy)
        for name in [name for name in copy.keys() if name.startswith("qc3d")]:  # noqa: SIM118 - not a dictionary
            del copy[name]
        if id_properties.has(copy, chain.slider):
            del copy[chain.slider]
        copy.animation_data_clear()
        for step, shape in enumerate(shapes):
            key = copy.shape_key_add(name=f"{step}/{chain.intervals}", from_mix=False)
            set_key_coordinates(key, shape)
            key.interpolation = 'KEY_LINEAR'
        absolute = keys_of(copy)
        absolute.use_relative = False
        for name in list(absolute.keys()):
            del absolute[name]
        last = absolute.key_blocks[-1].frame
        driver = compat.new_driver(absolute, "eval_time")
        slider.read_slider(driver, owner, chain.slider)
        driver.expression = f"min(max({slider.VARIABLE}, 0), 1) * {last!r}"
        for collection in obj.users_collection:
            collection.objects.link(copy)
        undo.pop_all()
    return copy


def copied(obj: bpy.types.Object, undo: ExitStack) -> bpy.types.Object:
    """A copy of a mesh object, with a mesh and keys of its own; closing ``undo`` removes it without a trace."""
    original = mesh_of(obj)
    copy = obj.copy()
    undo.callback(_remove, copy, original)
    copy.data = original.copy()
    return copy


def _remove(copy: bpy.types.Object, original: bpy.types.Mesh) -> None:
    """Remove an object with its mesh and keys, if they are not the original's, and the actions that only they used."""
    mesh, keys = mesh_of(copy), shape_keys_of(copy)
    actions = {block.animation_data.action for block in (copy, keys) if block is not None and block.animation_data}
    bpy.data.objects.remove(copy)
    if mesh != original:
        bpy.data.meshes.remove(mesh)
    for action in actions:
        if action is not None and action.users == 0:
            bpy.data.actions.remove(action)
