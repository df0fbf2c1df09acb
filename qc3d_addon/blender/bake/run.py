# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking in one call, for scripts, Blender's command line and the command ``qc3d bake``."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import bpy

from ...solver.errors import InputError
from .. import native_files
from ..kinds import keys_of, mesh_of
from ..store import checks
from .many import Verdict, bakeable_keys, plan_keys
from .plan import plan_bake, write_bake
from .request import BakeRequest, BakeResult
from .together import plan_together, write_together

if TYPE_CHECKING:
    from ...solver.support.progress import Done, OnProgress

# Estimate of the saved file's size, without its shape keys: this many times that of the opened one, which may be
# compressed.
_TIMES_THE_SIZE = 4

Result = TypeVar("Result")


def bake_object(
    obj: bpy.types.Object | None, request: BakeRequest, on_progress: OnProgress | None = None
) -> BakeResult:
    """Bake the in-betweens of two or more keys in this process, as shape keys that one key or slider plays.

    Everything is computed and checked before anything is written.

    Raises
    ------
    QC3DError
        If the object, the keys or the settings cannot be used; nothing is written then.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ...solver.frames.task import carry_out
    from ...solver.support.memory import machine_limit_mb
    from ...solver.support.progress import finish

    plan = plan_bake(obj, request)
    plan.task.require_memory(machine_limit_mb())
    return write_bake(plan, finish(carry_out(plan.task), on_progress))


def bake_objects_together(
    objects: Sequence[bpy.types.Object],
    request: BakeRequest,
    one_control: bool = True,
    on_progress: OnProgress | None = None,
) -> list[BakeResult]:
    """Make the in-betweens of several objects of one character in one map, in this process.

    Parameters
    ----------
    one_control
        Whether what plays those of the first object drives the others.

    Raises
    ------
    QC3DError
        If an object, the keys or the settings cannot be used; all are as they were.
    """
    from ...solver.frames.task import carry_out
    from ...solver.support.memory import machine_limit_mb
    from ...solver.support.progress import finish

    plan = plan_together(objects, request)
    plan.task.require_memory(machine_limit_mb())
    return write_together(plan, finish(carry_out(plan.task), on_progress), one_control)


def bake_object_keys(
    obj: bpy.types.Object,
    names: Sequence[str],
    choices: BakeRequest,
    on_progress: Callable[[Done], object] | None = None,
) -> list[Verdict]:
    """Bake keys of an object in one run in this process, each played by its own value.

    Parameters
    ----------
    names
        Names of the keys; empty for all.
    choices
        The request except for the keys.

    Raises
    ------
    QC3DError
        If the object or a name cannot be used. A key that cannot be baked raises nothing; its verdict says so.
    """
    from ...solver.support.memory import machine_limit_mb

    plan = plan_keys(obj, names or bakeable_keys(obj), choices, machine_limit_mb())
    return plan.write(plan.task.outcomes(on_progress))


def bake_file(
    path: Path,
    object_names: Sequence[str],
    work: Callable[[Sequence[bpy.types.Object]], list[tuple[Result, object]]],
    output: Path,
    report: Path | None = None,
) -> list[Result]:
    """Bake objects of a .blend file and save the result as another file.

    The file is opened in this process and replaces the open one; scripts in it do not run.

    Parameters
    ----------
    path
        The .blend file to open.
    object_names
        Names of the objects to bake; empty for all meshes with two shape keys or more.
    work
        Bakes them; returns for each its result and its report, as plain values.
    output
        The .blend file to write; it may be the same as ``path``.
    report
        A JSON file for the report, or None. It has the report of the object or, for several, of each by its name.

    Raises
    ------
    QC3DError
        If a file, an object, the keys or the settings cannot be used; no file is written.
    """
    from ...solver.files.atomic import replacing_all, require_writable

    reports = [] if report is None else [report]
    require_writable(output, *reports)
    require_writable(*reports, inputs=[path])
    _open(path)
    size = path.stat().st_size
    objects = _objects(path, object_names)
    done = dict(zip([obj.name for obj in objects], work(objects), strict=True))
    told = [values for _, values in done.values()]
    values = told[0] if len(object_names) == 1 else dict(zip(done, told, strict=True))
    # Beside their places: Blender writes the paths of images and libraries relative to the file's own folder.
    with replacing_all(output, *reports, beside=True) as (unfinished, *unfinished_reports):
        _save(unfinished, output, _TIMES_THE_SIZE * size + sum(map(_bytes_of_keys, objects)))
        for unfinished_report in unfinished_reports:
            unfinished_report.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")
    return [result for result, _ in done.values()]


def opened_object(path: Path, name: str) -> bpy.types.Object:
    """An object of a .blend file, which replaces the open one; scripts in it do not run.

    Raises
    ------
    InputError
        If the file cannot be read or has no such object.
    """
    _open(path)
    return _objects(path, [name])[0]


def _objects(path: Path, names: Sequence[str]) -> list[bpy.types.Object]:
    """The objects of these names, or all with keys that can be baked, one for each mesh."""
    meshes = [obj for obj in bpy.data.objects if obj.type == 'MESH']
    for name in names:
        if name not in bpy.data.objects:
            known = ", ".join(f"'{obj.name}'" for obj in meshes) or "none"
            raise InputError(f"{path} has no object '{name}'; its meshes: {known}.")
    if names:
        return [bpy.data.objects[name] for name in dict.fromkeys(names)]
    found = {obj.data: obj for obj in reversed(meshes) if checks.object_problem(obj) is None}
    if not found:
        raise InputError(f"{path} has no mesh with two shape keys that can be baked; add some.")
    return list(reversed(found.values()))


def _save(new: Path, output: Path, size: int) -> None:
    """Save the open file, of about ``size`` bytes, as ``new``, which then replaces ``output``."""
    from ...solver.files.atomic import require_room

    native_files.require_short(new, output)
    problem = None
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(new), copy=True, check_existing=False)
    except RuntimeError as error:
        problem = native_files.words(error, new, output)
    else:
        if new.exists() and not native_files.is_whole(new):
            problem = "Blender wrote only a part of it"
    if problem is not None:
        require_room(output, size)  # on a full disk, Blender reports another error or none
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
