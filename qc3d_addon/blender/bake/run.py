# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking in one go, as scripts, Blender's command and the command ``qc3d bake`` do it."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...solver.errors import InputError
from .. import native_files
from ..kinds import keys_of, mesh_of
from .plan import plan_bake, write_bake
from .request import BakeRequest, BakeResult

if TYPE_CHECKING:
    from ...solver.support.progress import Progress

_TIMES_THE_SIZE = 4  # of the file that was opened, which may be compressed, for what the bake adds besides keys

OnProgress = Callable[["Progress"], None]


def bake_object(
    obj: bpy.types.Object | None, request: BakeRequest, on_progress: OnProgress | None = None
) -> BakeResult:
    """Make the in-betweens of two keys or a row of keys, as shape keys that one slider plays, in this process.

    Everything is computed and checked before anything is written.

    Raises
    ------
    QC3DError
        If the object, the keys or the settings cannot be used; the object is as it was.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ...solver.frames.task import carry_out
    from ...solver.support.memory import machine_limit_mb
    from ...solver.support.progress import finish

    plan = plan_bake(obj, request)
    plan.task.require_memory(machine_limit_mb())
    return write_bake(plan, finish(carry_out(plan.task), on_progress))


def bake_file(
    path: Path,
    object_name: str,
    request: BakeRequest,
    output: Path,
    report: Path | None = None,
    on_progress: OnProgress | None = None,
) -> BakeResult:
    """Bake one object of a .blend file and save the result as another file.

    The file is opened in this process, in place of what is open in it; scripts in it do not run.

    Parameters
    ----------
    path
        The .blend file to open.
    object_name
        Name of the object to bake.
    request
        What to bake.
    output
        The .blend file to write; it may be the same as ``path``.
    report
        A JSON file to write the report to, or None.

    Raises
    ------
    QC3DError
        If a file, the object, the keys or the settings cannot be used; no file is written.
    """
    from ...solver.files.atomic import replacing_all, require_writable

    reports = [] if report is None else [report]
    require_writable(output, *reports)
    require_writable(*reports, inputs=[path])
    _open(path)
    size = path.stat().st_size
    obj = bpy.data.objects.get(object_name)
    if obj is None:
        meshes = ", ".join(f"'{other.name}'" for other in bpy.data.objects if other.type == 'MESH') or "none"
        raise InputError(f"{path} has no object '{object_name}'; its meshes: {meshes}.")
    result = bake_object(obj, request, on_progress)
    # Beside their places: Blender writes the paths of images and libraries relative to the file's own folder.
    with replacing_all(output, *reports, beside=True) as (unfinished, *unfinished_reports):
        _save(unfinished, output, _TIMES_THE_SIZE * size + _bytes_of_keys(obj))
        for unfinished_report in unfinished_reports:
            unfinished_report.write_text(json.dumps(result.report, indent=1) + "\n", encoding="utf-8")
    return result


def _save(new: Path, output: Path, size: int) -> None:
    """Save the file that is open, of about ``size`` bytes, as ``new``, which takes the place of ``output``."""
    from ...solver.files.atomic import require_room

    native_files.require_short(new, output)
    problem = None
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(new), copy=True, check_existing=False)
    except RuntimeError as error:
        problem = native_files.words(error, new, output)
    else:
        if new.exists() and not native_files.is_whole(new):
            problem = "Blender wrote a part of it only"
    if problem is not None:
        require_room(output, size)  # Blender calls a full disk a file that is not there, or nothing at all
        raise InputError(f"{output} cannot be written: {problem}.")


def _bytes_of_keys(obj: bpy.types.Object) -> int:
    return len(keys_of(obj).key_blocks) * len(mesh_of(obj).vertices) * 12


def _open(path: Path) -> None:
    from ...solver.files.npz import require_file

    require_file(path, sys.maxsize)
    native_files.require_short(path.resolve(), path)
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise InputError(f"{path} cannot be opened; it must be a .blend file this Blender can read.") from error
