# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape keys of a chain and its control, as they are in the file now."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...solver.errors import InputError
from ..kinds import keys_of, present
from ..store.chain import Chain
from ..store.id_properties import has
from . import drivers
from .control import Control, path_of, value_path


def owned_keys(keys: bpy.types.Key, chain: Chain) -> dict[int, bpy.types.ShapeKey]:
    """The shape keys that earlier bakes made for a chain and that still exist, by step.

    A chain owns a key if the record names it and its driver still reads the control. If the mesh has no key of a
    recorded name, the key was deleted or renamed: it was renamed if exactly one other key has the driver of that step.
    A key that was moved to the top of the list, which makes it the Basis, is the user's own from then on.
    """
    curves = drivers.driven_by(keys, path_of(chain))
    curves.pop(value_path(keys.reference_key.name), None)
    owned, missing = {}, []
    for step, name in chain.keys.items():
        if name in keys.key_blocks and value_path(name) in curves:
            owned[step] = keys.key_blocks[name]
        else:
            missing.append(step)
    recorded = set(owned.values())
    others = [key for key in keys.key_blocks if key not in recorded and value_path(key.name) in curves]
    weights = chain.weights if missing and others else None
    for step in missing:
        if weights is None:
            break
        renamed = [key for key in others if drivers.shows(curves[value_path(key.name)], weights, step)]
        if len(renamed) == 1:
            owned[step] = renamed[0]
    return owned


def all_owned_keys(keys: bpy.types.Key, chain: Chain) -> dict[int, bpy.types.ShapeKey]:
    """As ``owned_keys``, but raises InputError if one is missing."""
    owned = owned_keys(keys, chain)
    if owned.keys() != chain.keys.keys():
        raise InputError(f"Shape keys of '{chain.slider}' were deleted; re-bake it first.")
    return owned


def control_of(obj: bpy.types.Object, chain: Chain) -> Control:
    """The control of the chain: a key's value, or a slider.

    The slider is the one that the drivers read, on the object of an earlier bake, since objects may share a mesh;
    without drivers it is the one on ``obj``.
    """
    if chain.on_key:
        return Control(keys_of(obj), chain.on_key)
    for driver in _drivers(keys_of(obj), chain):
        owner = driver.variables[0].targets[0].id
        if isinstance(owner, bpy.types.Object) and not is_original(obj, owner, chain):
            return Control(owner, chain.slider)
    return Control(obj, chain.slider)


def original_of(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object | None:
    """The object whose slider the drivers of a copy still read, as after a script copied it; otherwise None."""
    for driver in _own_drivers(keys_of(obj), chain) if not chain.on_key else ():
        owner = driver.variables[0].targets[0].id
        if isinstance(owner, bpy.types.Object) and owner != obj and is_original(obj, owner, chain):
            return owner
    return None


def is_original(obj: bpy.types.Object, owner: bpy.types.Object, chain: Chain) -> bool:
    """Whether ``obj`` is a copy of ``owner``: a script copies the slider too, but the drivers read the original."""
    return owner.type == 'MESH' and owner.data != obj.data and has(owner, chain.slider) and has(obj, chain.slider)


def are_drivers_stopped(keys: bpy.types.Key, chain: Chain) -> bool:
    """Whether Blender has stopped the chain's drivers, which it does for good once the slider was NaN."""
    driver = next(_drivers(keys, chain), None)
    return driver is not None and not driver.is_valid


def restart_drivers(keys: bpy.types.Key, chain: Chain) -> None:
    """Restart drivers that Blender has stopped."""
    for curve in drivers.driven_by(keys, path_of(chain)).values():
        present(curve.driver).is_valid = True
    keys.update_tag()


def _drivers(keys: bpy.types.Key, chain: Chain) -> Iterator[bpy.types.Driver]:
    """The drivers that read the chain's control, those of its own keys first: there may be thousands of others."""
    yield from _own_drivers(keys, chain)
    yield from (present(curve.driver) for curve in drivers.driven_by(keys, path_of(chain)).values())


def _own_drivers(keys: bpy.types.Key, chain: Chain) -> Iterator[bpy.types.Driver]:
    """The drivers of the chain's own keys, under the names that the record has."""
    path = path_of(chain)
    for name in chain.keys.values():
        driver = drivers.driver_of(keys, name, path)
        if driver is not None:
            yield driver


def base_key(keys: bpy.types.Key, chain: Chain) -> bpy.types.ShapeKey:
    """The key that the chain's keys are relative to: the same as for the key that plays them, or the Basis."""
    key = keys.key_blocks.get(chain.on_key) if chain.on_key else None
    return keys.reference_key if key is None else key.relative_key
