# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that copy or save what a bug report needs: versions, settings, numbers of the mesh and the last error.

Nothing in it identifies the user's work: no names of objects, keys, files or people, and no coordinates, unless the
user asks for the shapes of the keys.
"""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

import platform
import re
import sys
import tomllib
from collections import Counter
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty

from ...solver.errors import InputError, QC3DError
from ...solver.settings import FitOptions, FrameOptions, PlayOptions
from ..kinds import keys_of, mesh_of, present, shape_keys_of
from ..preferences import limits
from ..properties import ObjectSettings, bake_request, panel_keys, settings_of
from ..store import mesh_data, records
from ..store.mirror_modifiers import mirror_planes
from .common import Status, last_error, report_error

if TYPE_CHECKING:
    from ...solver.keys.halves import MirrorPlane

_PACKAGE = Path(__file__).parents[2]
_MORE_SETTINGS = ("count", "use_tolerance", "tolerance", "play_on", "use_keyframes", "frame_start", "frame_end")
_ENDING = ".zip"
_NAMED = re.compile(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"|(?:[A-Za-z]:)?[\\/]\S+")


class QC3D_OT_copy_report(bpy.types.Operator):
    """Copy versions, settings, numbers of the mesh and the last error for a bug report; no names, no shapes"""

    bl_idname = "qc3d.copy_report"
    bl_label = "Copy Report for a Bug"

    def execute(self, context: bpy.types.Context) -> Status:
        present(context.window_manager).clipboard = report_text(context)
        self.report({'INFO'}, "The report was copied; paste it into the bug report.")
        return {'FINISHED'}


class QC3D_OT_save_report(bpy.types.Operator):
    """Save the report in a file, with the settings and, only if you choose it, the shapes of the keys in the panel"""

    bl_idname = "qc3d.save_report"
    bl_label = "Save Report for a Bug"

    if TYPE_CHECKING:
        filepath: str
        filter_glob: str
        check_existing: bool
        with_shapes: bool
    else:
        filepath: StringProperty(name="File", subtype='FILE_PATH', options={'SKIP_SAVE'})
        filter_glob: StringProperty(default=f"*{_ENDING}", options={'HIDDEN', 'SKIP_SAVE'})
        check_existing: BoolProperty(default=True, options={'HIDDEN', 'SKIP_SAVE'})
        with_shapes: BoolProperty(
            name="Include the Shapes",
            description="Put the keys in the panel into the file, so that a developer can bake them again. Everyone "
            "who gets the file can see them",
            default=False,
            options={'SKIP_SAVE'},
        )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        self.filepath = f"qc3d-report{_ENDING}"
        present(context.window_manager).fileselect_add(self)
        return {'RUNNING_MODAL'}

    def execute(self, context: bpy.types.Context) -> Status:
        try:
            if not self.filepath:
                raise InputError("Name a file to write.")
            path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), _ENDING))
            save_report(context, path, self.with_shapes)
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        shapes = "the shapes of the keys" if self.with_shapes else "no shapes"
        self.report({'INFO'}, f"{path.name} has the settings and {shapes}; attach it to the bug report.")
        return {'FINISHED'}


def save_report(context: bpy.types.Context, path: Path, with_shapes: bool) -> None:
    """Write the report and the settings of the active object's panel into a .zip.

    Raises
    ------
    InputError
        If there are no keys to include, or the file cannot be written.
    """
    from ...solver.files.atomic import replacing
    from ...solver.frames.bug_reports import write_bug_report

    text, obj = report_text(context), context.active_object
    through: tuple[str, ...] = ()
    options = FitOptions(), FrameOptions(), PlayOptions()
    has_keys = obj is not None and obj.type == 'MESH' and shape_keys_of(obj) is not None
    if obj is not None and has_keys:
        try:
            through = panel_keys(settings_of(obj))
            request = bake_request(settings_of(obj), through).timed
            options = request.fit_options, request.frame_options, request.play_options
        except QC3DError as error:
            text += f"\nThe settings cannot be used: {without_names(str(error))}\n"
    mesh = shapes = None
    planes: tuple[MirrorPlane, ...] = ()
    if with_shapes:
        if obj is None or not through:
            raise InputError("There are no shape keys to include; choose an object with two keys, or leave them out.")
        mesh, shapes = mesh_data.arrays_of(mesh_of(obj)), {
            name: mesh_data.shown_coordinates(obj, name) for name in dict.fromkeys(through)
        }
        planes = mirror_planes(obj, list(shapes.values()))
    with replacing(path) as place:
        write_bug_report(place, text, version(), through, options, mesh, shapes, planes)


def report_text(context: bpy.types.Context) -> str:
    """The report as lines of Markdown."""
    lines = _versions(context)
    obj = context.active_object
    if obj is not None and obj.type == 'MESH':
        lines += ["", "Mesh", *_mesh(obj), "", "Settings", *_settings(settings_of(obj)), "", "Bakes", *_bakes(obj)]
    else:
        lines += ["", f"Active object: {'none' if obj is None else obj.type}"]
    error = last_error()
    lines += ["", f"Last error: {'none' if error is None else without_names(error)}"]
    return "\n".join(lines) + "\n"


def without_names(text: str) -> str:
    """A sentence whose quoted parts and paths are left out, and all names of data in the file that are left."""
    text = _NAMED.sub("'…'", text)
    collections = (bpy.data.objects, bpy.data.meshes, bpy.data.collections, bpy.data.materials)
    names = {block.name for blocks in collections for block in blocks}  # type: ignore[attr-defined,unused-ignore]
    names |= {key.name for keys in bpy.data.shape_keys for key in keys.key_blocks}
    for name in sorted(names, key=len, reverse=True):
        text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", "…", text)
    return text


def version() -> str:
    """The add-on's version, from its manifest: beside the add-on where it is installed, above it in a checkout."""
    for folder in (_PACKAGE, _PACKAGE.parent):
        manifest = folder / "blender_manifest.toml"
        if manifest.is_file():
            return str(tomllib.loads(manifest.read_text(encoding="utf-8"))["version"])
    from importlib.metadata import version as installed

    return installed("qc3d")


def _versions(context: bpy.types.Context) -> list[str]:
    import scipy

    limit = limits(context)
    return [
        f"QC3D {version()}, Blender {bpy.app.version_string} ({bpy.app.build_platform.decode()})",
        f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}",
        f"{platform.system()} {platform.release()}, {platform.machine()}, {sys.byteorder} endian",
        f"Limits: {limit.seconds / 60:.0f} minutes, {limit.memory_mb:.0f} MB",
    ]


def _mesh(obj: bpy.types.Object) -> list[str]:
    mesh, keys = mesh_of(obj), shape_keys_of(obj)
    corners = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_total", corners)
    edges = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("edge_index", edges)
    faces_of_edges = Counter(np.bincount(edges, minlength=len(mesh.edges)).tolist())
    sides = ", ".join(f"{count} with {n} corners" for n, count in sorted(Counter(corners.tolist()).items()))
    lines = [
        f"- {len(mesh.vertices)} vertices, {len(mesh.edges)} edges, {len(mesh.polygons)} faces ({sides})",
        f"- edges without a face: {faces_of_edges[0]}, with one: {faces_of_edges[1]}, with more than two: "
        f"{sum(count for n, count in faces_of_edges.items() if n > 2)}",
        f"- loose parts: {_parts(mesh)}",
        f"- modifiers: {', '.join(modifier.type for modifier in obj.modifiers) or 'none'}",
        f"- mode: {obj.mode}",
    ]
    if keys is not None:
        drivers = keys.animation_data.drivers if keys.animation_data is not None else ()
        relative = "relative" if keys.use_relative else "absolute"
        muted = sum(key.mute for key in keys.key_blocks)
        lines.append(f"- {len(keys.key_blocks)} {relative} shape keys, {len(drivers)} drivers, {muted} muted")
    return lines


def _parts(mesh: bpy.types.Mesh) -> int:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends = np.empty(2 * len(mesh.edges), dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    first, second = ends.reshape(-1, 2).T
    count = len(mesh.vertices)
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return int(connected_components(graph, directed=False)[0])


def _settings(settings: ObjectSettings) -> list[str]:
    names = [field.name for kind in (FitOptions, FrameOptions, PlayOptions) for field in fields(kind)]
    shown = [name for name in (*names, *_MORE_SETTINGS) if hasattr(settings, name)]
    values = ", ".join(f"{name} {getattr(settings, name)}" for name in dict.fromkeys(shown) if name != "colliders")
    return [f"- {values}", f"- keys between: {len(settings.via)}, colliders: {'yes' if settings.colliders else 'no'}"]


def _bakes(obj: bpy.types.Object) -> list[str]:
    if shape_keys_of(obj) is None:
        return ["- none"]
    if records.state(keys_of(obj)).is_damaged:
        return ["- the record is damaged"]
    lines = []
    for chain in records.Record.read(keys_of(obj)).chains:
        lines.append(f"- {len(chain.through)} keys, {len(chain.keys)} in-betweens, on a key: {bool(chain.on_key)}")
        if chain.result is not None:
            lines += [f"  - {without_names(text)}" for text in _numbers(chain.result)]
    return lines or ["- none"]


def _numbers(result: object) -> list[str]:
    """The fields of a stored result that are numbers, or contain numbers."""
    found = []
    for field in fields(result) if is_dataclass(result) else ():
        value = getattr(result, field.name)
        if isinstance(value, (bool, int, float)):
            found.append(f"{field.name} {value:.6g}")
        elif is_dataclass(value):
            found += [f"{field.name}.{text}" for text in _numbers(value)]
    return found
