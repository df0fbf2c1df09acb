# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries about the arm of the demo file, sent to Blender after ``remote.py``."""

import hashlib
import sys

import bpy
import numpy as np

ADDON = 'bl_ext.user_default.qc3d'


def arm() -> bpy.types.Object:
    return bpy.data.objects['Arm']


def names() -> list[str]:
    return list(arm().data.shape_keys.key_blocks.keys())


def points(name: str) -> np.ndarray:
    key = arm().data.shape_keys.key_blocks[name]
    values = np.empty(3 * len(key.points), dtype=np.float32)
    key.points.foreach_get('co', values)
    return values


def sculpt(name: str) -> None:
    """Make the shape of a key a tenth larger."""
    arm().data.shape_keys.key_blocks[name].points.foreach_set('co', points(name) * np.float32(1.1))


def state() -> list[object]:
    """Everything that a bake may change."""
    keys = arm().data.shape_keys
    shapes = hashlib.sha256(b"".join(points(name).tobytes() for name in names())).hexdigest()
    values = [block.value for block in keys.key_blocks]
    drivers = [curve.data_path for curve in keys.animation_data.drivers] if keys.animation_data else []
    return [names(), values, shapes, sorted(arm().keys()), sorted(keys.keys()), drivers]


def remember(message: str) -> None:
    """Make an undo step, as every action of a user does."""
    with inside('WINDOW'):  # noqa: F821 - of remote.py
        bpy.ops.ed.undo_push(message=message)


def job() -> object:
    """The work that is going on, or None."""
    module = sys.modules.get(ADDON + '.blender.bake.jobs')
    return module and module.current()


def child() -> int | None:
    """The number of the process that does it."""
    return job() and job()._worker._process.pid
