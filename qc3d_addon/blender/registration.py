# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender is told about, in one ordered list."""

from __future__ import annotations

import bpy

from . import cli, compat, panels, properties
from .operators.bake_inbetweens import QC3D_OT_bake_inbetweens
from .operators.inner_keys import QC3D_OT_add_inner_key, QC3D_OT_remove_inner_key
from .operators.prepare import QC3D_OT_prepare

CLASSES = (
    properties.InnerKey,  # before what has it
    properties.ObjectSettings,
    QC3D_OT_prepare,
    QC3D_OT_bake_inbetweens,
    QC3D_OT_add_inner_key,
    QC3D_OT_remove_inner_key,
    panels.QC3D_PT_inbetweens,
)

_commands: list[object] = []


def register() -> None:
    """Register the classes, the object's settings and the command ``blender --command qc3d``."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.qc3d = bpy.props.PointerProperty(type=properties.ObjectSettings)
    _commands.extend(compat.register_command("qc3d", cli.run_command))


def unregister() -> None:
    """Undo ``register`` in reverse order."""
    while _commands:
        compat.unregister_command(_commands.pop())
    del bpy.types.Object.qc3d
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
