# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Between an object and the solver: what to compute, read from the object, and what came of it, written to it.

Time passes in between, and the animator may do anything: nothing of Blender's is held on to, the object is found
again, and what was read is compared before anything is written.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from ...solver.frames.easing import eased
from ..keys import shape_keys, slider
from ..kinds import keys_of
from ..store import checks, mesh_data, names
from ..store.records import Chain, KeptMap, Record
from ..store.summaries import Summary
from . import bookkeeping, colliders
from .request import PREVIEW_STEPS, BakeRequest, BakeResult
from .step_choice import chosen_steps

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome, Task
    from ...solver.keys.keypair import KeyPair
    from ...solver.settings import FitOptions


@dataclass(frozen=True)
class Plan:
    """What to compute for an object, and how to find it again.

    Parameters
    ----------
    request
        What was asked for.
    task
        The work.
    object_id
        Blender's number of the object, which stays with it for as long as the file is open, through renaming and undo.
    object_name
        What the object was called.
    notes
        Sentences for the user about what will be done.
    """

    request: BakeRequest
    task: Task
    object_id: int
    object_name: str
    notes: tuple[str, ...] = ()

    def locate(self) -> bpy.types.Object | None:
        """The object, whatever became of it; None where it was deleted."""
        obj = bpy.data.objects.get(self.object_name)
        if obj is not None and obj.session_uid == self.object_id:
            return obj
        return next((obj for obj in bpy.data.objects if obj.session_uid == self.object_id), None)

    def find_object(self) -> bpy.types.Object:
        """The object as it is now, where it can still be written to.

        Raises
        ------
        InputError
            If it is gone, is being edited, or what was read from it has changed.
        """
        obj = self.locate()
        if obj is None:
            raise InputError(f"'{self.object_name}' was deleted meanwhile; nothing was written.")
        checks.require_object(obj)
        try:
            pairs = mesh_data.read_pairs(obj, self.request.keys)
        except InputError as error:
            raise InputError(f"'{obj.name}' was changed meanwhile; nothing was written. {error}") from error
        if not all(_same(pair, self.task.pairs[ends]) for ends, pair in pairs.items()):
            raise InputError(f"'{obj.name}' was changed meanwhile; nothing was written. Bake again.")
        return obj


def plan_maps(obj: bpy.types.Object | None, request: BakeRequest) -> Plan:
    """Plan to make the map of every two keys that follow each other anew.

    Raises
    ------
    InputError
        If the object, the keys or the settings cannot be used.
    """
    from ...solver.frames.task import Task

    obj = checks.require_object(obj)
    Record.read(keys_of(obj))
    pairs = mesh_data.read_pairs(obj, request.keys)
    return Plan(request, Task(pairs, request.keys, request.fit_options), obj.session_uid, obj.name)


def plan_bake(obj: bpy.types.Object | None, request: BakeRequest) -> Plan:
    """Plan the in-betweens of two keys or a row of keys; maps that are kept and still fit are used again.

    Raises
    ------
    InputError
        If the object, the keys or the settings cannot be used.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ...solver.fit.storage import why_unusable
    from ...solver.frames.bake import evenly_spaced
    from ...solver.frames.task import Task

    obj = checks.require_object(obj)
    keys = keys_of(obj)
    record = Record.read(keys)
    pairs = mesh_data.read_pairs(obj, request.keys)
    shape_keys.require_writable(obj, _chain(obj, record, request), request.keyframes)
    usable, notes = {}, []
    for ends, pair in pairs.items():
        data = record.kept_map(keys, kept_map(ends, pair, request.fit_options))
        problem = None if data is None else why_unusable(data)
        if problem is not None:
            notes.append(f"The map that was kept from '{ends[0]}' to '{ends[1]}' {problem} and was made again.")
        elif data is not None:
            usable[ends] = data
    times = evenly_spaced(request.intervals - 1)
    collider = colliders.read_colliders(obj, request.colliders, request.keys)
    task = Task(pairs, request.keys, request.fit_options, request.frame_options, times, usable, collider)
    return Plan(request, task, obj.session_uid, obj.name, tuple(notes))


def request_again(obj: bpy.types.Object | None, chain: Chain) -> BakeRequest:
    """What a chain was baked from, to be made again.

    Raises
    ------
    InputError
        If the object cannot be used, or keys that the chain goes through are not there any more.
    """
    problem = checks.chain_problem(keys_of(checks.require_object(obj)), chain)
    if problem is not None:
        raise InputError(problem)
    return BakeRequest.again(chain.through, chain.request)


def plan_preview(obj: bpy.types.Object | None, chain: Chain) -> Plan:
    """Plan the frames of a baked chain as densely as a preview needs, evenly spaced before any easing.

    Raises
    ------
    InputError
        If the object or the keys cannot be used any more.
    """
    request = request_again(obj, chain)
    slider.require(shape_keys.slider_owner(checks.require_object(obj), chain), chain.slider)
    even = replace(request.frame_options, easing="linear")
    plan = plan_bake(obj, replace(request, count=PREVIEW_STEPS - 1, tolerance=0.0, frame_options=even))
    return replace(plan, request=request)


def write_maps(plan: Plan, outcome: Outcome) -> None:
    """Keep the maps with the object's keys, for later bakes.

    Raises
    ------
    InputError
        If the object is gone or was changed meanwhile; it is as it was.
    """
    keys = keys_of(plan.find_object())
    record = Record.read(keys)
    with ExitStack() as undo:
        _keep_maps(keys, record, plan, outcome, undo)
        record.write(keys, undo)
        undo.pop_all()


def write_bake(plan: Plan, outcome: Outcome) -> BakeResult:
    """Write the frames as shape keys that one slider plays.

    Raises
    ------
    InputError
        If the object is gone or was changed meanwhile; it is as it was.
    """
    obj, request, bake = plan.find_object(), plan.request, outcome.bake
    assert bake is not None
    keys = keys_of(obj)
    record = Record.read(keys)
    chain = _chain(obj, record, request)
    shape_keys.require_writable(obj, chain, request.keyframes)
    chosen, thinned = chosen_steps(bake, request, chain)
    intervals, times = len(chosen) - 1, bake.times[chosen]
    met, passed = _keys_on_the_way(times, request)
    shapes = shape_keys.shapes_by_step(obj, met, bake.frames[chosen])

    with shape_keys.chain_written(obj, chain, shapes, intervals, request.keyframes) as (undo, said):
        owner = shape_keys.slider_owner(obj, chain).name
        notes = [*plan.notes, *bake.report.notes, *said, *thinned, *passed]
        notes += colliders.changed_since(obj, request.colliders, request.keys, plan.task.collider)
        notes += _values_that_add(keys, request)
        report = {
            "object": obj.name,
            "from": request.keys[0],
            "via": list(request.keys[1:-1]),
            "to": request.keys[-1],
            "count": intervals // (len(request.keys) - 1) - 1,
            "keys": list(chain.keys.values()),
            "slider": chain.slider,
            "slider_object": owner,
            **bake.report.as_json(),
            "notes": notes,
        }
        chain.request, chain.mirror_of = request.remembered(), ""
        chain.result = Summary.of_report(bake.report, bake.times, chosen, notes)
        record.chains.append(record.chains.pop(record.chains.index(chain)))  # the newest is the last
        _keep_maps(keys, record, plan, outcome, undo)
        measures = {name: values[chosen] for name, values in bake.measures.items()}
        bookkeeping.remember(obj, record, chain, measures, undo)
        result = BakeResult(chain.slider, owner, tuple(chain.keys.values()), tuple(notes), report)
    return result


def kept_map(ends: tuple[str, str], pair: KeyPair, options: FitOptions) -> KeptMap:
    """Where the map of a pair is kept that was made with these options."""
    from ...solver.fit.storage import fingerprint

    return KeptMap(*ends, f"{fingerprint(pair)} {options.identity}")


def _same(pair: KeyPair, read: KeyPair) -> bool:
    arrays = ("key0", "key1", "faces", "edges", "polygons")
    return all(np.array_equal(getattr(pair, name), getattr(read, name)) for name in arrays)


def _keep_maps(keys: bpy.types.Key, record: Record, plan: Plan, outcome: Outcome, undo: ExitStack) -> None:
    for ends, data in outcome.fits.items():
        record.keep_map(keys, kept_map(ends, plan.task.pairs[ends], plan.request.fit_options), data, undo)


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
    along = eased(times, request.frame_options.easing) * (len(request.keys) - 1)
    met, sentences = {}, []
    for number, name in enumerate(request.keys):
        step = int(np.abs(along - number).argmin())
        if abs(along[step] - number) < 1e-9:
            met[step] = name
        else:
            sentences.append(
                f"With the easing {request.frame_options.easing} the slider passes '{name}' between two in-betweens, "
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
