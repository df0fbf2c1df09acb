# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of an object whose absolute shape keys are the steps of a chain, played by their evaluation time."""

from __future__ import annotations

import bpy

from .. import compat
from ..keys import shape_keys, slider
from ..store.mesh_data import key_coordinates, set_key_coordinates
from ..store.records import Chain


def copy_with_absolute_keys(obj: bpy.types.Object, chain: Chain) -> bpy.types.Object:
    """Make the copy beside the object, in its collections; the slider of the object plays it.

    Absolute keys are blended one after the other by a single number, without values of their own. They come in
    the order of the steps; the copy has no other keys.
    """
    keys = obj.data.shape_keys
    steps = shape_keys.owned_keys(keys, chain)
    rest = key_coordinates(obj, keys.reference_key.name)
    shapes = [
        key_coordinates(obj, steps[step].name) if step in steps else rest for step in range(chain.intervals + 1)
    ]
    owner = shape_keys.slider_owner(obj, chain)
    copy = obj.copy()
    copy.data = obj.data.copy()
    copy.name = copy.data.name = f"{obj.name} absolute"
    copy.shape_key_clear()
    for name in [name for name in copy.keys() if name.startswith("qc3d")]:  # noqa: SIM118 - not a dictionary
        del copy[name]
    if chain.slider in copy:
        del copy[chain.slider]
    copy.animation_data_clear()
    for step, shape in enumerate(shapes):
        key = copy.shape_key_add(name=f"{step}/{chain.intervals}", from_mix=False)
        set_key_coordinates(key, shape)
        key.interpolation = 'KEY_LINEAR'
    absolute = copy.data.shape_keys
    absolute.use_relative = False
    for key in list(absolute.keys()):
        del absolute[key]
    last = absolute.key_blocks[-1].frame
    curve = compat.new_driver(absolute, "eval_time")
    slider.read_slider(curve.driver, owner, chain.slider)
    curve.driver.expression = f"min(max({slider.VARIABLE}, 0), 1) * {last!r}"
    for collection in obj.users_collection:
        collection.objects.link(copy)
    return copy
