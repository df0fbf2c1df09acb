# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Drivers that give numbers of a control's position: how much of a shape to show, or how far along the steps it is.

Such a driver reads the control as its one variable, and its own curve is the function. Blender evaluates that in C,
without the permission that scripts need. A cubic Bézier curve whose handles stand at a third of every interval is the
cubic polynomial with these slopes (Farin 2002, *Curves and Surfaces for CAGD*, chapter 4).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import compat
from ..kinds import expect, present
from .control import Control, key_path, mute_path, value_path

if TYPE_CHECKING:
    from ...solver.frames.weights import Weights

VARIABLE = "slider"
# Blender takes points of a curve that are nearer than 0.01 to each other as one.
_LEAST_STEP = 0.02
# A cardinal spline falls to about 0.27 of itself from knot to knot: beyond so many it is 0 in single precision.
_REACH = 16
_CLOSE = 1e-4  # of values and places in curves: single precision, which users do not change by as little


def drive_value(key: bpy.types.ShapeKey, control: Control, weights: Weights, step: int) -> None:
    """Let the value of a shape key be the weight of a step, by its driver, which is made where there is none."""
    keys, path = expect(bpy.types.Key, key.id_data), value_path(key.name)
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(path)
    if curve is None:
        curve = compat.new_driver(keys, path)
    knots, values, slopes = _function(weights, step)
    stretch = _stretch(weights.knots)
    read(present(curve.driver), control, stretch)
    knots, slopes = knots * stretch, slopes / stretch
    width = np.diff(knots) / 3.0
    before, after = np.append(width[0], width), np.append(width, width[-1])
    left = np.column_stack([knots - before, values - before * slopes[0]])
    right = np.column_stack([knots + after, values + after * slopes[1]])
    _set_curve(curve, np.column_stack([knots, values]), left, right, 'BEZIER')
    curve.extrapolation = 'LINEAR'


def drive_mute(key: bpy.types.ShapeKey, control: Control) -> None:
    """Let a key be muted together with the one that plays it."""
    keys, path = expect(bpy.types.Key, key.id_data), mute_path(key.name)
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(path)
    if curve is None:
        curve = compat.new_driver(keys, path)
    _read_path(present(curve.driver), control, mute_path(control.name))


def drive_position(curve: bpy.types.FCurve, control: Control, places: ArrayLike, values: ArrayLike) -> None:
    """Let a new driver go straight through values (k,) at places (k,) of the control, and stay at them at the ends."""
    stretch = _stretch(np.asarray(places))
    read(present(curve.driver), control, stretch)
    points = np.column_stack([np.asarray(places) * stretch, values])
    _set_curve(curve, points, points, points, 'LINEAR')
    curve.extrapolation = 'CONSTANT'


def read(driver: bpy.types.Driver, control: Control, stretch: int = 1) -> None:
    """Let a driver have the control as its only variable, and so many times its value."""
    _read_path(driver, control, control.path)
    if stretch != 1:
        driver.type = 'SCRIPTED'
        driver.expression = f"{VARIABLE} * {stretch}"  # simple enough to run without the permission that scripts need


def _read_path(driver: bpy.types.Driver, control: Control, path: str) -> None:
    driver.type = 'AVERAGE'
    driver.expression = ""
    while len(driver.variables) > 1:
        driver.variables.remove(driver.variables[-1])
    variable = driver.variables[0] if driver.variables else driver.variables.new()
    variable.name = VARIABLE
    variable.type = 'SINGLE_PROP'
    target = variable.targets[0]
    target.id_type = control.id_type
    target.id = control.owner
    target.data_path = path
    driver.is_valid = True  # Blender stops a driver for good where its variable was NaN once


def shows(curve: bpy.types.FCurve, weights: Weights, step: int) -> bool:
    """Whether a driver of this curve gives the weight of a step, as a bake of this or an earlier version made it."""
    if present(curve.driver).expression == _earlier_expression(step, len(weights.knots) - 1):
        return True
    knots, values, _ = _function(weights, step)
    points = np.empty(2 * len(curve.keyframe_points))
    curve.keyframe_points.foreach_get("co", points)
    wanted = np.column_stack([knots * _stretch(weights.knots), values])
    return len(points) == wanted.size and np.allclose(points.reshape(-1, 2), wanted, rtol=0.0, atol=_CLOSE)


def undrive(key: bpy.types.ShapeKey) -> None:
    """Remove all drivers of a shape key."""
    keys, path = expect(bpy.types.Key, key.id_data), key_path(key.name)
    if keys.animation_data is not None:
        for driven in [curve.data_path for curve in keys.animation_data.drivers if curve.data_path.startswith(path)]:
            keys.driver_remove(driven)


def paths_read(keys: bpy.types.Key) -> Counter[str]:
    """How often drivers of the file read properties of shape keys, by path."""
    return Counter(
        target.data_path
        for curve in all_drivers()
        for variable in present(curve.driver).variables
        for target in variable.targets
        if target.id == keys
    )


def all_drivers() -> Iterator[bpy.types.FCurve]:
    """All drivers of the file, but those of what nobody uses any more, which goes when the file is saved."""
    for collection in bpy.data.bl_rna.properties:
        if collection.type != 'COLLECTION':
            continue
        for block in getattr(bpy.data, collection.identifier):
            owner = block.user if isinstance(block, bpy.types.Key) else block
            if owner is None or not owner.users:
                continue
            animation = getattr(block, "animation_data", None)
            if animation is not None:
                yield from animation.drivers
            tree = getattr(block, "node_tree", None)
            if tree is not None and tree.animation_data is not None:
                yield from tree.animation_data.drivers


def driver_of(keys: bpy.types.Key, key_name: str, path: str) -> bpy.types.Driver | None:
    """The driver of a shape key's value, where it reads the control of that path alone. Quick enough for a panel."""
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(value_path(key_name))
    return curve.driver if curve is not None and _reads_alone(curve.driver, path) else None


def driven_by(keys: bpy.types.Key, path: str) -> dict[str, bpy.types.FCurve]:
    """The curves of the drivers that read the control of that path alone, by the path of what they drive."""
    if keys.animation_data is None:
        return {}
    return {curve.data_path: curve for curve in keys.animation_data.drivers if _reads_alone(curve.driver, path)}


def reads(driver: bpy.types.Driver | None, control: Control) -> bool:
    """Whether a driver of any kind reads the control."""
    return driver is not None and any(
        target.id == control.owner and target.data_path == control.path
        for variable in driver.variables
        for target in variable.targets
    )


def _stretch(knots: NDArray[np.float64]) -> int:
    """How many times the control a curve is over, so that its points stand apart."""
    least = float(np.diff(knots).min())
    return 1 if least >= _LEAST_STEP else 10 ** int(np.ceil(np.log10(_LEAST_STEP / least)))


def _function(weights: Weights, step: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Knots (k,), values (k,) and slopes (2, k) of the weight of a step, as far as it is not 0."""
    near = slice(max(step - _REACH, 0), step + _REACH + 1)
    knots, slopes = weights.knots[near], weights.slopes[:, near, step].copy()
    values = np.zeros(len(knots))
    values[step - near.start] = 1.0
    slopes[np.abs(slopes) < 1e-6] = 0.0  # what is left of it where the reach ends is no slope to go on along
    return knots, values, slopes


def _set_curve(
    curve: bpy.types.FCurve,
    points: NDArray[np.float64],
    left: NDArray[np.float64],
    right: NDArray[np.float64],
    interpolation: str,
) -> None:
    """Make a curve anew of points (k, 2) with handles (k, 2) on either side."""
    while curve.modifiers:
        curve.modifiers.remove(curve.modifiers[0])
    frames = curve.keyframe_points
    frames.clear()
    frames.add(len(points))
    kinds = bpy.types.Keyframe.bl_rna.properties
    for name, kind in (("interpolation", interpolation), ("handle_left_type", 'FREE'), ("handle_right_type", 'FREE')):
        frames.foreach_set(name, [expect(bpy.types.EnumProperty, kinds[name]).enum_items[kind].value] * len(points))
    for name, places in (("co", points), ("handle_left", left), ("handle_right", right)):
        frames.foreach_set(name, places.ravel())
    curve.update()


def _reads_alone(driver: bpy.types.Driver | None, path: str) -> bool:
    if driver is None:
        return False
    variables = driver.variables
    return (
        len(variables) == 1
        and variables[0].name == VARIABLE
        and variables[0].type == 'SINGLE_PROP'
        and variables[0].targets[0].data_path == path
    )


def _earlier_expression(step: int, intervals: int) -> str:
    """The hat that drivers of earlier versions have, which a bake replaces by a curve."""
    return f"max(0, 1 - abs({VARIABLE} * {intervals} - {step}))"
