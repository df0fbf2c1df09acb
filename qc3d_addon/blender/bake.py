# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking as the operators, Blender's command and the command ``qc3d bake`` share it."""

from __future__ import annotations

import json
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..solver.easing import eased
from ..solver.errors import InputError
from ..solver.settings import Settings
from . import checks, mesh_data, names, shape_keys
from .maps import OnProgress, maps_of_pairs
from .records import Chain, Record


@dataclass(frozen=True)
class BakeRequest:
    """What to bake between shape keys of an object.

    Parameters
    ----------
    keys
        Names of two keys or more, from the first to the last; the same name may come again, but not twice in a row.
    count
        Number of in-betweens between every two keys that follow each other, evenly spaced.
    settings
        The solver's settings.
    keyframes
        First and last frame between which the slider goes from 0 to 1, or None to leave it without keyframes.
    """

    keys: tuple[str, ...]
    count: int = 3
    settings: Settings = field(default_factory=Settings)
    keyframes: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if len(self.keys) < 2:
            raise InputError("In-betweens need two keys or more.")
        most = names.MAX_STEPS // (len(self.keys) - 1) - 1
        if most < 1:
            raise InputError(f"{len(self.keys)} keys in a row are too many for one slider; bake them in parts.")
        if not 1 <= self.count <= most:
            raise InputError(f"{self.count} in-betweens are not possible; 1 to {most} are.")
        if self.keyframes is not None and self.keyframes[0] >= self.keyframes[1]:
            first, last = self.keyframes
            raise InputError(f"Keyframes from {first} to {last} are not possible; the last must come after the first.")

    @property
    def intervals(self) -> int:
        """Number of steps from the first key to the last."""
        return (self.count + 1) * (len(self.keys) - 1)


@dataclass(frozen=True)
class BakeResult:
    """What a bake made.

    Parameters
    ----------
    slider
        Name of the custom property that plays the chain.
    slider_object
        Name of the object that has it.
    keys
        Names of the generated shape keys, from the first key to the last.
    notes
        Sentences for the user.
    report
        The pipeline's report with the names above: plain values that can be written as JSON.
    """

    slider: str
    slider_object: str
    keys: tuple[str, ...]
    notes: tuple[str, ...]
    report: dict[str, Any]

    def summary(self) -> str:
        """One sentence: what was made and where the slider is."""
        seconds = sum(self.report["seconds"].values())
        total = self.report["count"] * (len(self.report["via"]) + 1)
        return (
            f"{total} in-betweens in {seconds:.1f} s (engine {self.report['engine']}); "
            f"the slider is '{self.slider}' on '{self.slider_object}'."
        )


def prepare_object(obj: bpy.types.Object | None, request: BakeRequest, on_progress: OnProgress | None = None) -> None:
    """Make the map of every two keys that follow each other anew and keep it with them, for later bakes.

    Raises
    ------
    QC3DError
        If the object, the keys or the settings cannot be used; the object is as it was.
    """
    obj = checks.require_object(obj)
    keys = obj.data.shape_keys
    record = Record.read(keys)
    pairs = mesh_data.read_pairs(obj, request.keys)
    for made in maps_of_pairs(keys, pairs, request.settings, on_progress, None).values():
        record.keep_map(keys, made.kept, made.data)
    record.write(keys)


def bake_object(
    obj: bpy.types.Object | None, request: BakeRequest, on_progress: OnProgress | None = None
) -> BakeResult:
    """Make the in-betweens of two keys or a row of keys, as shape keys that one slider plays.

    Everything is computed and checked before anything is written.

    Raises
    ------
    QC3DError
        If the object, the keys or the settings cannot be used; the object is as it was.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ..solver.pipeline import chain_inbetweens, evenly_spaced, finish

    obj = checks.require_object(obj)
    keys = obj.data.shape_keys
    record = Record.read(keys)
    pairs = mesh_data.read_pairs(obj, request.keys)
    chain = _chain(obj, record, request)
    shape_keys.require_writable(obj, chain, request.keyframes)

    maps = maps_of_pairs(keys, pairs, request.settings, on_progress, record)
    prepared = [maps[ends].prepared for ends in pairwise(request.keys)]
    times = evenly_spaced(request.intervals - 1)
    bake = finish(chain_inbetweens(prepared, times, request.settings), on_progress)
    met, passed = _keys_on_the_way(times, request)
    shapes = shape_keys.shapes_by_step(obj, met, bake.frames)

    notes = shape_keys.write_chain(obj, chain, shapes, request.intervals, request.keyframes)
    for used in maps.values():
        record.keep_map(keys, used.kept, used.data)
    record.write(keys)

    owner = shape_keys.slider_owner(obj, chain).name
    notes = [*bake.report["notes"], *notes, *passed, *_values_that_add(keys, request)]
    report = {
        "object": obj.name,
        "from": request.keys[0],
        "via": list(request.keys[1:-1]),
        "to": request.keys[-1],
        "count": request.count,
        "keys": list(chain.keys.values()),
        "slider": chain.slider,
        "slider_object": owner,
        **bake.report,
        "notes": notes,
    }
    return BakeResult(chain.slider, owner, tuple(chain.keys.values()), tuple(notes), report)


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
    from ..solver.array_files import replacing

    _open(path)
    obj = bpy.data.objects.get(object_name)
    if obj is None:
        meshes = ", ".join(f"'{other.name}'" for other in bpy.data.objects if other.type == 'MESH') or "none"
        raise InputError(f"{path} has no object '{object_name}'; its meshes: {meshes}.")
    with ExitStack() as stack:
        # Opened before the work starts, so that a folder that cannot be written to is found out first.
        unfinished = stack.enter_context(replacing(output))
        unfinished_report = None if report is None else stack.enter_context(replacing(report))
        result = bake_object(obj, request, on_progress)
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(unfinished), copy=True, check_existing=False)
            if unfinished_report is not None:
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


def _chain(obj: bpy.types.Object, record: Record, request: BakeRequest) -> Chain:
    """The entry of these keys in the record, made where there is none."""
    chain = record.chain(request.keys)
    if chain is None:
        taken = {*obj.keys(), *(other.slider for other in record.chains)}
        chain = Chain(request.keys, names.chain_label(request.keys, taken))
        record.chains.append(chain)
    return chain


def _keys_on_the_way(times: NDArray[np.float64], request: BakeRequest) -> tuple[dict[int, str], list[str]]:
    """Which step shows which of the request's keys, and a sentence for each key that the slider passes between steps.

    The steps are even on the slider, also where the way between the keys is eased.
    """
    along = eased(times, request.settings.easing) * (len(request.keys) - 1)
    met, sentences = {}, []
    for number, name in enumerate(request.keys):
        step = int(np.abs(along - number).argmin())
        if abs(along[step] - number) < 1e-9:
            met[step] = name
        else:
            sentences.append(
                f"With the easing {request.settings.easing} the slider passes '{name}' between two in-betweens, "
                f"at {np.interp(number, along, times):.2f}; to meet it, bake with the easing linear and ease the "
                "slider's keyframes."
            )
    return met, sentences


def _values_that_add(keys: bpy.types.Key, request: BakeRequest) -> list[str]:
    """A sentence for each of the keys that is on by itself: the slider alone would show another shape."""
    blocks = [keys.key_blocks[name] for name in dict.fromkeys(request.keys)]
    return [
        f"Key '{key.name}' is on by itself ({key.value:.2f}), which adds to what the slider shows; set it to 0."
        for key in blocks
        if key != keys.reference_key and key.value != 0.0 and not key.mute
    ]
