# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking as the operators, Blender's command and the command ``qc3d bake`` share it."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ..solver.errors import InputError
from ..solver.settings import Settings
from . import checks, mesh_data, names, shape_keys
from .records import Chain, KeptMap, Record

if TYPE_CHECKING:
    from ..solver.keypair import KeyPair
    from ..solver.pipeline import Progress
    from ..solver.prepared import PreparedMap

OnProgress = Callable[["Progress"], None]


@dataclass(frozen=True)
class BakeRequest:
    """What to bake between two shape keys of an object.

    Parameters
    ----------
    from_key, to_key
        Names of the first and the second key.
    count
        Number of in-betweens, evenly spaced.
    settings
        The solver's settings.
    keyframes
        First and last frame between which the slider goes from 0 to 1, or None to leave it without keyframes.
    """

    from_key: str
    to_key: str
    count: int = 3
    settings: Settings = field(default_factory=Settings)
    keyframes: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.count <= names.MAX_INBETWEENS:
            raise InputError(f"{self.count} in-betweens are not possible; 1 to {names.MAX_INBETWEENS} are.")
        if self.keyframes is not None and self.keyframes[0] >= self.keyframes[1]:
            first, last = self.keyframes
            raise InputError(f"Keyframes from {first} to {last} are not possible; the last must come after the first.")


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
        Names of the generated shape keys, from the first key to the second.
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
        return (
            f"{self.report['count']} in-betweens in {seconds:.1f} s (engine {self.report['engine']}); "
            f"the slider is '{self.slider}' on '{self.slider_object}'."
        )


def prepare_object(obj: bpy.types.Object | None, request: BakeRequest, on_progress: OnProgress | None = None) -> None:
    """Make the map of two keys anew and keep it with them, for later bakes.

    Raises
    ------
    QC3DError
        If the object, the keys or the settings cannot be used; the object is as it was.
    """
    # Imported where they are used, here and below: scipy would make Blender start slower.
    from ..solver import storage

    obj = checks.require_object(obj)
    keys = obj.data.shape_keys
    record = Record.read(keys)
    pair = mesh_data.read_pair(obj, request.from_key, request.to_key)
    data = storage.to_bytes(_prepare(pair, request, on_progress))
    record.keep_map(keys, _kept_map(pair, request), data)
    record.write(keys)


def bake_object(
    obj: bpy.types.Object | None, request: BakeRequest, on_progress: OnProgress | None = None
) -> BakeResult:
    """Make the in-betweens of two keys, as shape keys that one slider plays.

    Everything is computed and checked before anything is written.

    Raises
    ------
    QC3DError
        If the object, the keys or the settings cannot be used; the object is as it was.
    """
    from ..solver import storage
    from ..solver.pipeline import evenly_spaced, finish, inbetweens

    obj = checks.require_object(obj)
    keys = obj.data.shape_keys
    record = Record.read(keys)
    pair = mesh_data.read_pair(obj, request.from_key, request.to_key)
    chain = _chain(obj, record, request)
    shape_keys.require_writable(obj, chain, request.keyframes)

    kept_map = _kept_map(pair, request)
    data = record.kept_map(keys, kept_map)
    if data is None:
        prepared = _prepare(pair, request, on_progress)
        data = storage.to_bytes(prepared)
    else:
        prepared = storage.from_bytes(data, pair)
    bake = finish(inbetweens(prepared, evenly_spaced(request.count), request.settings), on_progress)
    shapes = shape_keys.shapes_by_step(obj, chain, bake.frames)

    notes = shape_keys.write_chain(obj, chain, shapes, request.count + 1, request.keyframes)
    record.keep_map(keys, kept_map, data)
    record.write(keys)

    owner = shape_keys.slider_owner(obj, chain).name
    notes = [*bake.report["notes"], *notes, *_values_that_add(keys, request)]
    report = {
        "object": obj.name,
        "from": request.from_key,
        "to": request.to_key,
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
    """The pair's entry in the record, made where there is none."""
    chain = record.chain(request.from_key, request.to_key)
    if chain is None:
        taken = {*obj.keys(), *(other.slider for other in record.chains)}
        chain = Chain(request.from_key, request.to_key, names.chain_label(request.from_key, request.to_key, taken))
        record.chains.append(chain)
    return chain


def _kept_map(pair: KeyPair, request: BakeRequest) -> KeptMap:
    """The entry of a map that was made from exactly these keys and settings."""
    from ..solver.storage import fingerprint

    settings = request.settings  # the mode is not part of it: one map serves every mode
    made_from = f"{fingerprint(pair)} {settings.preparation}"
    return KeptMap(request.from_key, request.to_key, made_from)


def _prepare(pair: KeyPair, request: BakeRequest, on_progress: OnProgress | None) -> PreparedMap:
    from ..solver.pipeline import finish, prepare

    return finish(prepare(pair, request.settings), on_progress)


def _values_that_add(keys: bpy.types.Key, request: BakeRequest) -> list[str]:
    """A sentence for each of the two keys that is on by itself: the slider alone would show another shape."""
    blocks = [keys.key_blocks[name] for name in (request.from_key, request.to_key)]
    return [
        f"Key '{key.name}' is on by itself ({key.value:.2f}), which adds to what the slider shows; set it to 0."
        for key in blocks
        if key != keys.reference_key and key.value != 0.0 and not key.mute
    ]
