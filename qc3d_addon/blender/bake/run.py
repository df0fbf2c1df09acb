# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking in one go, as scripts, Blender's command and the command ``qc3d bake`` do it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ...solver.errors import InputError
from .plan import plan_bake, write_bake
from .request import BakeRequest, BakeResult

if TYPE_CHECKING:
    from ...solver.support.progress import Progress

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
    from ...solver.files.npz import replacing_all

    _open(path)
    obj = bpy.data.objects.get(object_name)
    if obj is None:
        meshes = ", ".join(f"'{other.name}'" for other in bpy.data.objects if other.type == 'MESH') or "none"
        raise InputError(f"{path} has no object '{object_name}'; its meshes: {meshes}.")
    # Opened before the work starts, so that a folder that cannot be written to is found out first.
    with replacing_all(output, *([] if report is None else [report])) as (unfinished, *unfinished_reports):
        result = bake_object(obj, request, on_progress)
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(unfinished), copy=True, check_existing=False)
            for unfinished_report in unfinished_reports:
                unfinished_report.write_text(json.dumps(result.report, indent=1) + "\n", encoding="utf-8")
        except (OSError, RuntimeError) as error:
            raise InputError(f"The results cannot be written: {error}.") from error
    return result


def _open(path: Path) -> None:
    if not path.is_file():
        raise InputError(f"There is no file {path}.")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise InputError(f"{path} cannot be opened; it must be a .blend file this Blender can read.") from error
