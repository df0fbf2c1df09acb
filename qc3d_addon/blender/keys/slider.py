# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The one slider of a chain: a custom property of the object, the drivers that read it, and its keyframes.

At 0 the slider shows the first key, at 1 the last, and on its way those between, each through a copy that the bake
makes, since the animator's own keys are not touched; the Basis needs no copy. Where none of the keys is the Basis, the
slider thus shows the first key from the moment of the bake on. What other keys are on adds to it, as shape keys do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import bpy

from ...solver.errors import InputError
from .. import compat
from ..kinds import expect
from ..store import id_properties
from ..store.records import Chain

VARIABLE = "slider"


def data_path(name: str) -> str:
    """The path of the custom property from its object."""
    return f'["{bpy.utils.escape_identifier(name)}"]'


def expression(step: int, intervals: int) -> str:
    """A hat over the slider: 1 where ``slider * intervals`` is ``step``, 0 from the neighbouring steps on.

    The hats of all steps add up to 1, so the shape between two in-betweens is their straight blend. Blender counts this
    as a simple expression: it runs without the permission that scripts need.
    """
    return f"max(0, 1 - abs({VARIABLE} * {intervals} - {step}))"


def problem(obj: bpy.types.Object, name: str) -> str | None:
    """Why the slider of that name cannot play anything, or None. Quick enough for a panel."""
    if not id_properties.has(obj, name):
        return f"The slider '{name}' was deleted; re-bake it first."
    if not is_number(obj, name):
        return (
            f"The slider '{name}' of '{obj.name}' is not a number any more; delete that custom property, then re-bake "
            "to have it again."
        )
    if math.isnan(obj[name]):
        return f"The slider '{name}' of '{obj.name}' has no value (NaN); give it one, or mend what drives it."
    return None


def is_number(obj: bpy.types.Object, name: str) -> bool:
    """Whether the slider has a type that can play anything: the user may give it any other."""
    return isinstance(obj[name], (bool, int, float))


def require(obj: bpy.types.Object, name: str) -> None:
    """Raise InputError unless ``obj`` has the slider of that name and it is a number."""
    found = problem(obj, name)
    if found is not None:
        raise InputError(found)


def ensure_property(obj: bpy.types.Object, name: str, start: float, undo: ExitStack) -> None:
    """Give ``obj`` the slider; one that is there keeps its value. Closing ``undo`` takes a new one away."""
    if not id_properties.has(obj, name):
        undo.callback(obj.pop, name, None)
        obj[name] = start
        interface: Callable[[str], Any] = obj.id_properties_ui  # the stubs say that it returns nothing
        interface(name).update(
            min=0.0,
            max=1.0,
            soft_min=0.0,
            soft_max=1.0,
            step=1.0,
            default=start,
            description="Plays the in-betweens: 0 is the first key, 1 the last",
        )
        # So that a character linked into a shot can be animated with it.
        obj.property_overridable_library_set(data_path(name), True)


def drive(key: bpy.types.ShapeKey, obj: bpy.types.Object, name: str, step: int, intervals: int) -> None:
    """Drive the value of a shape key by the slider."""
    driver = compat.new_driver(expect(bpy.types.Key, key.id_data), value_path(key.name))
    read_slider(driver, obj, name)
    driver.expression = expression(step, intervals)


def read_slider(driver: bpy.types.Driver, obj: bpy.types.Object, name: str) -> None:
    """Give a new driver the slider as the variable that its expression can use."""
    driver.type = 'SCRIPTED'
    variable = driver.variables.new()
    variable.name = VARIABLE
    variable.type = 'SINGLE_PROP'
    variable.targets[0].id = obj
    variable.targets[0].data_path = data_path(name)


def undrive(key: bpy.types.ShapeKey) -> None:
    """Remove the driver of a shape key's value, if it has one."""
    keys, path = expect(bpy.types.Key, key.id_data), value_path(key.name)
    if keys.animation_data is not None and keys.animation_data.drivers.find(path) is not None:
        keys.driver_remove(path)


def retarget(driver: bpy.types.Driver, obj: bpy.types.Object, undo: ExitStack) -> None:
    """Let a driver read the slider of ``obj``; the object that it read before may have been deleted."""
    target = driver.variables[0].targets[0]
    undo.callback(setattr, target, "id", target.id)
    undo.callback(setattr, target, "id_type", target.id_type)
    target.id_type = 'OBJECT'
    target.id = obj
    driver.is_valid = True  # Blender stops a driver for good where its variable was NaN once


def value_path(key_name: str) -> str:
    """The path of a shape key's value from its data block."""
    return f'key_blocks["{bpy.utils.escape_identifier(key_name)}"].value'


def driver_of(keys: bpy.types.Key, key_name: str, name: str) -> bpy.types.Driver | None:
    """The driver of a shape key's value, where it reads the slider ``name`` alone. Quick enough for a panel."""
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(value_path(key_name))
    driver = None if curve is None else curve.driver
    return driver if driver is not None and _reads(driver, name) else None


def driven_by(keys: bpy.types.Key, name: str) -> dict[str, bpy.types.Driver]:
    """The drivers that read the slider ``name`` alone, by the path of what they drive."""
    if keys.animation_data is None:
        return {}
    drivers = {curve.data_path: curve.driver for curve in keys.animation_data.drivers}
    return {path: driver for path, driver in drivers.items() if driver is not None and _reads(driver, name)}


def reads(driver: bpy.types.Driver, obj: bpy.types.Object, name: str) -> bool:
    """Whether a driver of any kind reads the slider of ``obj``."""
    return any(
        target.id == obj and target.data_path == data_path(name)
        for variable in driver.variables
        for target in variable.targets
    )


def _reads(driver: bpy.types.Driver, name: str) -> bool:
    variables = driver.variables
    return (
        len(variables) == 1
        and variables[0].name == VARIABLE
        and variables[0].type == 'SINGLE_PROP'
        and variables[0].targets[0].data_path == data_path(name)
    )


def begin_keyframes(
    obj: bpy.types.Object, chain: Chain, wanted: tuple[int, int], undo: ExitStack
) -> tuple[bpy.types.FCurve | None, list[str]]:
    """The curve to give keyframes over two frames, None where it is left as it is; a sentence where that is so.

    Keyframes that the animator made are never replaced, and neither are those of an earlier bake over the same frames,
    whose timing may have been edited since. Closing ``undo`` takes back what was made.
    """
    path = data_path(chain.slider)
    existing = compat.find_fcurve(obj, path)
    if existing is not None and len(existing.keyframe_points):
        if chain.keyframes is None:
            return None, [f"The slider '{chain.slider}' is animated already; its keyframes were left as they are."]
        if chain.keyframes == wanted:
            return None, []
    return compat.ensure_fcurve(obj, path, undo), []


def set_keyframes(curve: bpy.types.FCurve, frames: tuple[int, int]) -> None:
    """Animate the slider from 0 to 1 over two frames, linearly, in place of the keyframes that are there."""
    while len(curve.keyframe_points):
        curve.keyframe_points.remove(curve.keyframe_points[0], fast=True)
    for frame, value in zip(frames, (0.0, 1.0), strict=True):
        curve.keyframe_points.insert(frame, value, options={'FAST'}).interpolation = 'LINEAR'
    curve.update()
