# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that save the maps of a bake and load them for the same mesh in another file."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, StringProperty

from ...solver.errors import InputError, QC3DError
from ..bake import map_files
from ..kinds import present
from ..properties import fill_panel, settings_of
from ..store import checks
from ..store.chain import Chain
from ..store.records import Record
from .chains import ChainWork
from .common import SLIDER, Status, poll_active_object, poll_chains, report_error

_ENDING = ".qc3dmap"
if TYPE_CHECKING:
    _FILTER = str
else:
    _FILTER = StringProperty(default=f"*{_ENDING}", options={'HIDDEN', 'SKIP_SAVE'})


class QC3D_OT_save_map(ChainWork, bpy.types.Operator):
    """Save the map of these in-betweens to a file, to use it for the same mesh in another .blend file"""

    bl_idname = "qc3d.save_map"
    bl_label = "Save Map"
    bl_options = {'REGISTER'}  # nothing in the file changes

    if TYPE_CHECKING:
        slider: SLIDER
        filepath: str
        check_existing: bool
        filter_glob: _FILTER
    else:
        slider: SLIDER
        filepath: StringProperty(name="File", subtype='FILE_PATH', options={'SKIP_SAVE'})
        check_existing: BoolProperty(default=True, options={'HIDDEN', 'SKIP_SAVE'})
        filter_glob: _FILTER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        self.filepath = f"{bpy.path.clean_name(present(context.active_object).name)}{_ENDING}"
        present(context.window_manager).fileselect_add(self)
        return {'RUNNING_MODAL'}

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        path = _path(self.filepath, "write")
        count = map_files.save_maps(obj, chain, path)
        return [f"{path.name} has {'the map' if count == 1 else f'{count} maps'} of '{chain.slider}'."]


class QC3D_OT_load_map(bpy.types.Operator):
    """Load a map that was saved for the same mesh and shape keys, so that the next bake need not compute it"""

    bl_idname = "qc3d.load_map"
    bl_label = "Load Map"
    bl_options = {'REGISTER', 'UNDO'}

    if TYPE_CHECKING:
        filepath: str
        filter_glob: _FILTER
    else:
        filepath: StringProperty(name="File", subtype='FILE_PATH', options={'SKIP_SAVE'})
        filter_glob: _FILTER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        present(context.window_manager).fileselect_add(self)
        return {'RUNNING_MODAL'}

    def execute(self, context: bpy.types.Context) -> Status:
        try:
            obj = checks.require_object(context.active_object)
            loaded = map_files.load_maps(obj, _path(self.filepath, "read"))
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        # A map can be used only with the options that it was made with, so the panel takes them over.
        fill_panel(settings_of(obj), loaded.through, loaded.options)
        names = " to ".join(f"'{name}'" for name in loaded.through)
        self.report({'INFO'}, f"The map from {names} is ready; the panel shows its options.")
        return {'FINISHED'}


def _path(name: str, purpose: str) -> Path:
    if not name:
        raise InputError(f"Name a file to {purpose}.")
    return Path(bpy.path.ensure_ext(bpy.path.abspath(name), _ENDING))
