# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Drivers that compute numbers from a control: the value of a shape key, or the position along the steps.

Such a driver reads the control as its one variable, and its own F-curve is the function. Blender evaluates that in C,
without the permission that Python expressions need. A cubic Bézier curve whose handles lie at a third of every interval
is the cubic polynomial with these slopes (Farin 2002, *Curves and Surfaces for CAGD*, chapter 4).
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

VARIABLE, MUTED = "slider", "muted"
# Blender merges points of a curve that are nearer than 0.01 to each other.
_LEAST_STEP = 0.02
# In knots. A cardinal spline decays by a factor of 0.27 per knot, so beyond 16 knots it is 0 in single precision.
_REACH = 16
_CLOSE = 1e-4  # tolerance for values and places in curves, which are in single precision


def drive_value(key: bpy.types.ShapeKey, control: Control, weights: Weights, step: int) -> None:
    """Drive the value of a shape key by the weight of a step; adds the driver if there is none."""
    keys, path = expect(bpy.types.Key, key.id_data), value_path(key.name)
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(path)
    if curve is None:
        curve = compat.new_driver(keys, path)
    knots, values, slopes = _function(weights, step)
    stretch = _stretch(weights.knots)
    read(present(curve.driver), control, stretch)
    if control.is_key:
        _mute_with(present(curve.driver), control, stretch)
        _free_mute(key, control)
    knots, slopes = knots * stretch, slopes / stretch
    width = np.diff(knots) / 3.0
    before, after = np.append(width[0], width), np.append(width, width[-1])
    left = np.column_stack([knots - before, values - before * slopes[0]])
    right = np.column_stack([knots + after, values + after * slopes[1]])
    _set_curve(curve, np.column_stack([knots, values]), left, right, 'BEZIER')
    curve.extrapolation = 'LINEAR'


def _mute_with(driver: bpy.types.Driver, control: Control, stretch: int) -> None:
    """Let a driver read 0, where weights are 0, while the key that it reads is muted.

    A driver of the key's own ``mute`` would be simpler, but makes Blender 4.5 and 5.2 write the values of all driven
    keys back, to unshare what they are in, while other threads give them new ones: now and then an in-between shows the
    frame before.
    """
    variable = driver.variables.new()
    variable.name, variable.type = MUTED, 'SINGLE_PROP'
    target = variable.targets[0]
    target.id_type, target.id, target.data_path = control.id_type, control.owner, mute_path(control.name)
    driver.type = 'SCRIPTED'
    times = "" if stretch == 1 else f" * {stretch}"
    driver.expression = f"{VARIABLE}{times} * (1 - {MUTED})"  # simple enough to run without permission, too


def _free_mute(key: bpy.types.ShapeKey, control: Control) -> None:
    """Remove the driver by which an earlier bake muted a key."""
    keys, path = expect(bpy.types.Key, key.id_data), mute_path(key.name)
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(path)
    if curve is not None and _reads_alone(curve.driver, mute_path(control.name)):
        keys.driver_remove(path)
        key.mute = False


def drive_position(curve: bpy.types.FCurve, control: Control, places: ArrayLike, values: ArrayLike) -> None:
    """Let a new driver interpolate values (k,) at places (k,) of the control linearly, constant beyond the ends."""
    stretch = _stretch(np.asarray(places))
    read(present(curve.driver), control, stretch)
    points = np.column_stack([np.asarray(places) * stretch, values])
    _set_curve(curve, points, points, points, 'LINEAR')
    curve.extrapolation = 'CONSTANT'


def read(driver: bpy.types.Driver, control: Control, stretch: int = 1) -> None:
    """Let a driver read the control as its only variable and multiply it by ``stretch``."""
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
    driver.is_valid = True  # Blender stops a driver for good once its variable was NaN


def shows(curve: bpy.types.FCurve, weights: Weights, step: int) -> bool:
    """Whether a driver's curve is the weight of a step, as this version or an earlier one writes it."""
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
    """Number of times that drivers of the file read properties of shape keys, by RNA path."""
    return Counter(
        target.data_path
        for curve in all_drivers()
        for variable in present(curve.driver).variables
        for target in variable.targets
        if target.id == keys
    )


def all_drivers() -> Iterator[bpy.types.FCurve]:
    """All drivers of the file, except those of data blocks without users, which are not saved."""
    for collection in bpy.data.bl_rna.properties:
        if collection.type != 'COLLECTION' or collection.identifier == 'all_ids':  # which has all others again
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
    """The driver of a shape key's value if it reads only the control at ``path``. Fast enough for a panel."""
    curve = None if keys.animation_data is None else keys.animation_data.drivers.find(value_path(key_name))
    return curve.driver if curve is not None and _reads_alone(curve.driver, path) else None


def driven_by(keys: bpy.types.Key, path: str) -> dict[str, bpy.types.FCurve]:
    """The curves of the drivers that read only the control at ``path``, by the RNA path of the driven property."""
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
    """Factor on the control that spreads the points of a curve at least ``_LEAST_STEP`` apart."""
    least = float(np.diff(knots).min())
    return 1 if least >= _LEAST_STEP else 10 ** int(np.ceil(np.log10(_LEAST_STEP / least)))


def _function(weights: Weights, step: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Knots (k,), values (k,) and slopes (2, k) of the weight of a step where it is not 0."""
    near = slice(max(step - _REACH, 0), step + _REACH + 1)
    knots, slopes = weights.knots[near], weights.slopes[:, near, step].copy()
    values = np.zeros(len(knots))
    values[step - near.start] = 1.0
    slopes[np.abs(slopes) < 1e-6] = 0.0  # so that the curve is 0, not linear, beyond the last knot in reach
    return knots, values, slopes


def _set_curve(
    curve: bpy.types.FCurve,
    points: NDArray[np.float64],
    left: NDArray[np.float64],
    right: NDArray[np.float64],
    interpolation: str,
) -> None:
    """Replace all points of a curve by points (k, 2) with left and right handles (k, 2)."""
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
    """Whether a driver reads the control of a path and, beside it, at most whether it is muted."""
    if driver is None:
        return False
    variables = driver.variables
    return (
        [variable.name for variable in variables] in ([VARIABLE], [VARIABLE, MUTED])
        and variables[0].type == 'SINGLE_PROP'
        and variables[0].targets[0].data_path == path
    )


def _earlier_expression(step: int, intervals: int) -> str:
    """The hat function in drivers of earlier versions; a bake replaces it by a curve."""
    return f"max(0, 1 - abs({VARIABLE} * {intervals} - {step}))"
