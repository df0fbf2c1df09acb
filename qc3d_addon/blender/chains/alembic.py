# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of a chain as an Alembic file, written by Blender's own exporter."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import bpy

from ...solver.errors import InputError
from ...solver.files.atomic import replacing, require_room
from .. import compat, native_files
from ..keys import chain_keys, drivers, slider
from ..kinds import keys_of, mesh_of, present
from ..store.chain import Chain
from .absolute_copy import copied

# Bytes per vertex or face corner: position or normal in each frame; index and position once; texture coordinates.
_BYTES_OF_FRAME, _BYTES_ONCE, _BYTES_OF_TEXTURE = 12, 48, 16
_BYTES_BESIDE = 2**20


def export_alembic(context: bpy.types.Context, obj: bpy.types.Object, chain: Chain, path: Path, frames: int) -> None:
    """Write the object, with modifiers, while its slider goes from 0 to 1 over the frames 1 to ``frames``.

    A temporary copy is animated and exported, so the object and its animation stay as they are.

    Raises
    ------
    InputError
        If the file cannot be written; an existing file stays as it is.
    """
    scene, layer = present(context.scene), present(context.view_layer)
    control = chain_keys.control_of(obj, chain)
    with ExitStack() as undo:
        undo.callback(scene.frame_set, scene.frame_current, subframe=scene.frame_subframe)
        undo.callback(_select, layer, set(context.selected_objects or ()), layer.objects.active)
        copy = copied(obj, undo)
        copy.hide_viewport = copy.hide_render = False
        collection = bpy.data.collections.new("QC3D export")
        undo.callback(bpy.data.collections.remove, collection)
        scene.collection.children.link(collection)
        collection.objects.link(copy)
        copy.animation_data_clear()
        played = control.of(keys_of(copy) if control.is_key else copy)
        if control.is_key:
            keys_of(copy).driver_remove(control.path)
        else:
            copy[chain.slider] = 0.0
            for driven in drivers.driven_by(keys_of(copy), control.path).values():
                if drivers.reads(driven.driver, control):
                    present(driven.driver).variables[0].targets[0].id = copy
        curve = compat.ensure_fcurve(played.owner, control.path, undo)
        slider.set_keyframes(curve, [(1.0, 0.0), (float(frames), 1.0)])
        layer.update()  # only what it knows to be shown can be selected
        _select(layer, {copy}, copy)
        require_room(path, _largest_size(context, copy, frames))
        with replacing(path) as unfinished:
            native_files.require_short(unfinished, path)
            try:
                result = bpy.ops.wm.alembic_export(
                    filepath=str(unfinished),
                    start=1,
                    end=frames,
                    selected=True,
                    apply_subdiv=True,  # otherwise a Subdivision modifier at the end is left out
                    as_background_job=False,
                )
            except RuntimeError as error:
                words = native_files.words(error, unfinished, path)
                raise InputError(f"{path} cannot be written: {words}.") from error
            if result != {'FINISHED'}:
                raise InputError(f"{path} was not written by Blender's Alembic exporter; try another folder.")


def _select(layer: bpy.types.ViewLayer, objects: set[bpy.types.Object], active: bpy.types.Object | None) -> None:
    """Select exactly these objects."""
    for obj in layer.objects:
        if obj is not None:  # an object that has just been removed is None
            obj.select_set(obj in objects, view_layer=layer)
    layer.objects.active = active


def _largest_size(context: bpy.types.Context, copy: bpy.types.Object, frames: int) -> int:
    """Upper bound of the file's size in bytes. On a full disk Blender's exporter crashes Blender.

    The exporter evaluates modifiers as for rendering; those of the copy are set so that the viewport shows the same.
    """
    for modifier in copy.modifiers:
        modifier.show_viewport = modifier.show_render
        if isinstance(modifier, (bpy.types.SubsurfModifier, bpy.types.MultiresModifier)):
            modifier.levels = modifier.render_levels
    mesh = mesh_of(copy.evaluated_get(context.evaluated_depsgraph_get()))
    corners = len(mesh.vertices) + len(mesh.loops)
    once = _BYTES_ONCE + _BYTES_OF_TEXTURE * len(mesh.uv_layers)
    return corners * (_BYTES_OF_FRAME * frames + once) + _BYTES_BESIDE
