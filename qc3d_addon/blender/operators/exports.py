# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that export in-betweens to other programs and read them from USD files."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ...solver.errors import InputError, QC3DError
from ..exports import export, read_usd
from ..kinds import present
from .common import Status, end_previews, poll_active_object, poll_chains, report_error

_FORMATS = (
    ('.usdc', "USD", "Blend shapes with in-betweens: Maya, Unreal, Houdini"),
    ('.usda', "USD as Text", "The same as a text file"),
    ('.fbx', "FBX", "Blend-shape channels with in-between targets: Maya, Unity"),
    ('.glb', "glTF", "Morph targets with animated weights: game engines, viewers, VRM tools"),
)


class QC3D_OT_export_in_betweens(bpy.types.Operator):
    """Export the object with its shape keys, their in-betweens and the animation for other programs"""

    bl_idname = "qc3d.export_in_betweens"
    bl_label = "Export In-Betweens"
    bl_options = {'REGISTER'}  # nothing in the file changes

    if TYPE_CHECKING:
        filepath: str
        check_existing: bool
        filter_glob: str
        format: str
        density: int
    else:
        filepath: StringProperty(name="File", subtype='FILE_PATH', options={'SKIP_SAVE'})
        check_existing: BoolProperty(default=True, options={'HIDDEN', 'SKIP_SAVE'})
        filter_glob: StringProperty(
            default=";".join(f"*{ending}" for ending in export.SUFFIXES), options={'HIDDEN', 'SKIP_SAVE'}
        )
        format: EnumProperty(
            name="Format", items=_FORMATS, description="File format; used if the file name has no extension"
        )
        density: IntProperty(
            name="Shapes",
            description="In-betweens per key in USD and FBX; vertices move on straight lines between them",
            default=export.DENSITY,
            min=1,
            max=99,
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        self.filepath = f"{bpy.path.clean_name(present(context.active_object).name)}{self.format}"
        present(context.window_manager).fileselect_add(self)
        return {'RUNNING_MODAL'}

    def check(self, context: bpy.types.Context) -> bool:
        """Change the extension of the file name to the format chosen in the file browser."""
        path = Path(self.filepath)
        if path.suffix == self.format or path.suffix not in export.SUFFIXES:
            return False
        self.filepath = str(path.with_suffix(self.format))
        return True

    def execute(self, context: bpy.types.Context) -> Status:
        end_previews()
        try:
            path = _path(self.filepath)
            path = path if path.suffix else path.with_suffix(self.format)
            notes = export.export(context.active_object, path, self.density)
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        for note in notes:
            self.report({'WARNING'}, note)
        self.report({'INFO'}, f"{path.name} has '{present(context.active_object).name}' with its in-betweens.")
        return {'FINISHED'}


class QC3D_OT_read_usd(bpy.types.Operator):
    """Read the in-betweens of shape keys of the same names from a USD file; Blender's own import drops them"""

    bl_idname = "qc3d.read_usd"
    bl_label = "Read In-Betweens from USD"
    bl_options = {'REGISTER', 'UNDO'}

    if TYPE_CHECKING:
        filepath: str
        filter_glob: str
    else:
        filepath: StringProperty(name="File", subtype='FILE_PATH', options={'SKIP_SAVE'})
        filter_glob: StringProperty(default="*.usd;*.usda;*.usdc;*.usdz", options={'HIDDEN', 'SKIP_SAVE'})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        present(context.window_manager).fileselect_add(self)
        return {'RUNNING_MODAL'}

    def execute(self, context: bpy.types.Context) -> Status:
        end_previews()
        try:
            *notes, done = read_usd.read_in_betweens(context.active_object, _path(self.filepath))
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        for note in notes:
            self.report({'WARNING'}, note)
        self.report({'INFO'}, done)
        return {'FINISHED'}


def _path(name: str) -> Path:
    if not name:
        raise InputError("Name a file.")
    return Path(bpy.path.abspath(name))
