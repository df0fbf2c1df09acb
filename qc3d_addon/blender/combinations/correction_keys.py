# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The keys that correct a combination: written with their drivers, all or none, and removed."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack

import bpy
import numpy as np

from ...solver.arrays import Floats
from ...solver.errors import InputError
from .. import compat
from ..keys import shape_keys
from ..keys.control import mute_path, value_path
from ..kinds import keys_of, present
from ..store import combined_keys, names
from ..store.combined_keys import Combined
from ..store.mesh_data import key_coordinates, set_key_coordinates

# A correction is close to the product of the values: parabolas through these follow it, and need a key for each pair.
PLACES = (0.5, 1.0)


def write(
    obj: bpy.types.Object,
    named: tuple[str, ...],
    corrections: dict[tuple[float, ...], Floats],
    earlier: Combined | None,
    known: list[Combined],
) -> Combined:
    """Write the correction keys, all of them or, if anything fails, none.

    Parameters
    ----------
    obj
    named
        Names of the keys that are on at once, from the outermost to the innermost.
    corrections
        What is added to the base (n, 3), by the values of the keys at which it is added as a whole.
    earlier
        The combination that is written again, whose keys keep their names; None if it is new.
    known
        All combinations of the keys.
    """
    keys = keys_of(obj)
    relative = keys.key_blocks[named[0]].relative_key
    start = key_coordinates(obj, relative.name)
    # The earlier time's values in the order of this one.
    there = {}
    if earlier is not None:
        own = [earlier.keys.index(name) for name in named]
        there = {tuple(places[number] for number in own): name_of for name_of, places in earlier.made}
    active = obj.active_shape_key_index
    with ExitStack() as undo:
        made = []
        for places, correction in corrections.items():
            if places in there:
                key = keys.key_blocks[there.pop(places)]
                undo.callback(set_key_coordinates, key, key_coordinates(obj, key.name))
            else:
                key = shape_keys.new_key(obj, names.combination_name(named, places), relative, undo)
            set_key_coordinates(key, (start + correction).astype(np.float32))
            _drive(keys, key, named, places)
            made.append((key.name, places))
        combined = Combined(named, tuple(made), combined_keys.digests_of(keys, named))
        others = [one for one in known if one is not earlier]
        combined_keys.write(keys, [*others, combined], undo)
        undo.pop_all()
    shape_keys.remove_keys(obj, [keys.key_blocks[name] for name in there.values()])
    obj.active_shape_key_index = active
    keys.update_tag()
    return combined


def remove(obj: bpy.types.Object, combined: Combined) -> list[str]:
    """Remove the correction keys of a combination; sentences about those that stay because drivers read them."""
    keys = keys_of(obj)
    require_unlocked(keys, [name for name, _ in combined.made])
    left = [one for one in combined_keys.read(keys) if one.keys != combined.keys]
    notes = shape_keys.remove_keys(obj, [keys.key_blocks[name] for name, _ in combined.made])
    with ExitStack() as undo:
        combined_keys.write(keys, left, undo)
        undo.pop_all()
    return notes


def require_unlocked(keys: bpy.types.Key, names_: Sequence[str] | set[str]) -> None:
    """Raise InputError if a correction key that would be written or removed is locked."""
    for name in names_:
        if keys.key_blocks[name].lock_shape:
            raise InputError(f"Shape key '{name}' of an earlier combination is locked; unlock it first.")


def _drive(keys: bpy.types.Key, key: bpy.types.ShapeKey, named: Sequence[str], places: Sequence[float]) -> None:
    """Drive a correction key by the values of the combined keys; it is 0 if one of these is muted.

    The expression is simple enough for Blender to evaluate it without the permission that scripts need.
    """
    path = value_path(key.name)
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(path)
    curve = compat.new_driver(keys, path) if curve is None else curve
    driver = present(curve.driver)
    driver.type = 'SCRIPTED'
    while driver.variables:
        driver.variables.remove(driver.variables[0])
    factors = []
    for number, (name, place) in enumerate(zip(named, places, strict=True)):
        for letter, path_of in (("v", value_path), ("m", mute_path)):
            variable = driver.variables.new()
            variable.name = f"{letter}{number}"
            target = variable.targets[0]
            target.id_type, target.id, target.data_path = 'KEY', keys, path_of(name)
        factors += [_cardinal(f"v{number}", place), f"(1-m{number})"]
    driver.expression = "*".join(factors)
    driver.is_valid = True


def _cardinal(variable: str, place: float) -> str:
    """The Lagrange polynomial that is 1 at one place and 0 at the others and at 0, as an expression."""
    others = [other for other in (0.0, *PLACES) if other != place]
    scale = 1.0 / float(np.prod([place - other for other in others]))
    parts = [variable if other == 0.0 else f"({variable}-{other:g})" for other in others]
    return "*".join([f"{scale:.9g}", *parts])
