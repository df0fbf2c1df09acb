# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of an object whose absolute shape keys are the steps of a chain, played by their evaluation time."""

from __future__ import annotations

from contextlib import ExitStack

import bpy
import numpy as np

from ...solver.arrays import Floats
from .. import compat
from ..heat_map import heat_map
from ..keys import chain_keys, chain_shapes, drivers
from ..kinds import keys_of, mesh_of, shape_keys_of
from ..store import id_properties, names
from ..store.chain import Chain
from ..store.mesh_data import set_key_coordinates

_LEAST_STEPS = 24  # with so many, straight lines miss a rotation by 90 degrees by 0.05 % of the radius


def copy_with_absolute_keys(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object:
    """Make the copy in the object's collections; the slider of the object plays it.

    Blender interpolates absolute keys linearly from one to the next by a single number. To follow a smooth path
    closely, the copy has additional keys between the steps; it has no others.

    Raises
    ------
    InputError
        If a generated key was deleted, or the slider is not a number; nothing is changed then.
    """
    control = chain_keys.control_of(obj, chain)
    control.require()
    shapes = chain_shapes.step_shapes(obj, chain)
    is_smooth = len(chain.corners) < chain.intervals - 1
    places = _denser(chain.places) if is_smooth else np.array(chain.places)
    shapes = np.where(
        np.isin(places, chain.places)[:, None, None],
        shapes[np.searchsorted(chain.places, places).clip(max=chain.intervals)],
        chain.weights.played(shapes, places),
    )
    with ExitStack() as undo:
        copy = copied(obj, undo)
        copy.name = mesh_of(copy).name = f"{obj.name} absolute"
        heat_map.hide(copy)  # it belongs to the original
        compat.clear_shape_keys(copy)
        for name in [name for name in copy.keys() if name.startswith("qc3d")]:  # noqa: SIM118 - not a dictionary
            del copy[name]
        if id_properties.has(copy, chain.slider):
            del copy[chain.slider]
        copy.animation_data_clear()
        for step, shape in enumerate(shapes):
            key = copy.shape_key_add(name=names.key_name(chain.slider, step, places.tolist()), from_mix=False)
            set_key_coordinates(key, shape)
            key.interpolation = 'KEY_LINEAR'
        absolute = keys_of(copy)
        absolute.use_relative = False
        for name in list(absolute.keys()):
            del absolute[name]
        curve = compat.new_driver(absolute, "eval_time")
        drivers.drive_position(curve, control, places, [key.frame for key in absolute.key_blocks])
        for collection in obj.users_collection:
            collection.objects.link(copy)
        undo.pop_all()
    return copy


def _denser(places: tuple[float, ...]) -> Floats:
    """Places of absolute keys: evenly subdivided between every two until there are at least ``_LEAST_STEPS``."""
    parts = -(-_LEAST_STEPS // (len(places) - 1))
    between = np.arange(parts) / parts
    inner = np.array(places[:-1])[:, None] + between * np.diff(places)[:, None]
    return np.append(inner.ravel(), places[-1])


def copied(obj: bpy.types.Object, undo: ExitStack) -> bpy.types.Object:
    """A copy of a mesh object with its own mesh and keys; closing ``undo`` removes it without a trace."""
    original = mesh_of(obj)
    copy = obj.copy()
    undo.callback(_remove, copy, original)
    copy.data = original.copy()
    return copy


def _remove(copy: bpy.types.Object, original: bpy.types.Mesh) -> None:
    """Remove an object, its mesh and keys if they are not the original's, and the actions that only they used."""
    mesh, keys = mesh_of(copy), shape_keys_of(copy)
    actions = {block.animation_data.action for block in (copy, keys) if block is not None and block.animation_data}
    bpy.data.objects.remove(copy)
    if mesh != original:
        bpy.data.meshes.remove(mesh)
    for action in actions:
        if action is not None and action.users == 0:
            bpy.data.actions.remove(action)
