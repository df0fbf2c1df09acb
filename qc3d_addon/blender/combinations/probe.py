# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates an object at given values of some keys, including in-betweens and drivers, on a temporary copy."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import permutations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.arrays import Floats
from ..chains.absolute_copy import copied
from ..keys.control import key_path, value_path
from ..kinds import keys_of, mesh_of, present

# Two evaluations in a row that agree are right: see the values for glTF.
_MOST_EVALUATIONS = 10
# What stands between the names of keys in the name of a shape for all of them.
_MARKS = ("_", "+", "-", " + ", "__", ".", " ", "_x_")


@contextmanager
def probed(
    obj: bpy.types.Object, names: Sequence[str], left_out: Collection[str]
) -> Iterator[Callable[[Sequence[float]], Floats]]:
    """A function that returns the positions (n, 3) at values of the keys ``names``, with all others at 0.

    Keys that are driven by these keys follow them; those ``left_out`` stay at 0. A key that is named after all of them,
    such as ``A_B``, but not driven by them, is taken for a combination key that bones or properties drive: its value is
    the product of theirs. The object stays as it is.
    """
    with ExitStack() as undo:
        copy = copied(obj, undo)
        collection = bpy.data.collections.new("QC3D probe")
        undo.callback(bpy.data.collections.remove, collection)
        present(present(bpy.context.scene).collection).children.link(collection)
        collection.objects.link(copy)
        copy.modifiers.clear()
        copy.animation_data_clear()
        copy.show_only_shape_key = copy.hide_viewport = False
        keys = keys_of(copy)
        _quiet(keys, names, left_out)
        own = [key for key in _named_after(keys, names) if key.name not in left_out]

        def shown(values: Sequence[float]) -> Floats:
            for name, value in zip(names, values, strict=True):
                keys.key_blocks[name].value = value
            for key in own:
                key.value = float(np.prod(values))
            found = _evaluated(copy)
            for _ in range(_MOST_EVALUATIONS):
                before, found = found, _evaluated(copy)
                if np.array_equal(before, found):
                    break
            return found.astype(np.float64)

        yield shown


def _quiet(keys: bpy.types.Key, names: Sequence[str], left_out: Collection[str]) -> None:
    """Remove everything that moves a copy's keys, except drivers that read the values of some of them."""
    animation = keys.animation_data
    if animation is not None:
        animation.action = None
        for track in list(animation.nla_tracks):
            animation.nla_tracks.remove(track)
        still = [key_path(name) for name in (*names, *left_out)]
        for curve in list(animation.drivers):
            targets = [target.id for variable in present(curve.driver).variables for target in variable.targets]
            if keys not in targets or curve.data_path.startswith(tuple(still)):
                keys.driver_remove(curve.data_path)
    for key in keys.key_blocks:
        is_driven = animation is not None and animation.drivers.find(value_path(key.name)) is not None
        if key.name in names:
            key.mute, key.slider_min, key.slider_max = False, 0.0, 1.0
        elif key.name in left_out:
            key.mute = True
        if not is_driven:
            key.value = 0.0


def _named_after(keys: bpy.types.Key, names: Sequence[str]) -> list[bpy.types.ShapeKey]:
    """Keys without a driver that are named after all of ``names``, as riggers name combinations."""
    wanted = {mark.join(order) for order in permutations(names) for mark in _MARKS}
    drivers = [] if keys.animation_data is None else [curve.data_path for curve in keys.animation_data.drivers]
    return [key for key in keys.key_blocks if key.name in wanted and value_path(key.name) not in drivers]


def _evaluated(copy: bpy.types.Object) -> NDArray[np.float32]:
    keys_of(copy).update_tag()
    copy.update_tag()
    mesh = mesh_of(copy.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)
