# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Between an object and the solver: reads from the object what to compute, and writes the outcome to it.

In the time between, the user may do anything. Therefore no Blender data is held, the object is looked up again, and
the keys are compared with those that were read before anything is written.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...solver.errors import InputError
from ..keys import chain_keys, chain_shapes, own_keyframes, shape_keys
from ..keys.double_motion import double_motion, unknown_inbetweens
from ..keys.leftovers import leftovers, sentence
from ..keys.sculpted import Sculpted
from ..kinds import keys_of
from ..store import checks, mesh_data, names
from ..store.chain import Chain
from ..store.records import KeptMap, Record
from ..store.renames import digest
from ..store.summaries import Summary
from . import bookkeeping, colliders
from .request import BakeRequest, BakeResult
from .seams import opened_seams
from .suggested_keys import made_keys

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome, Task
    from ...solver.keys.keypair import KeyPair
    from ...solver.settings import FitOptions


@dataclass(frozen=True)
class Plan:
    """What to compute for an object, and how to find the object again.

    Parameters
    ----------
    request
        The request for the bake.
    task
        The task for the solver.
    object_id
        The object's ``session_uid``, which survives renaming and undo while the file is open.
    object_name
        Name of the object when the plan was made.
    notes
        Sentences for the user.
    """

    request: BakeRequest
    task: Task
    object_id: int
    object_name: str
    notes: tuple[str, ...] = ()

    def locate(self) -> bpy.types.Object | None:
        """The object, even if it was renamed or changed; None if it was deleted."""
        return located(self.object_name, self.object_id)

    def find_object(self) -> bpy.types.Object:
        """The object, after checking that the outcome can still be written to it.

        Raises
        ------
        InputError
            If it was deleted, is being edited, or its keys have changed since the plan was made.
        """
        obj = self.locate()
        if obj is None:
            raise InputError(f"'{self.object_name}' was deleted meanwhile; nothing was written.")
        checks.require_object(obj)
        try:
            checks.require_control(keys_of(obj), self.request.keys, self.request.base)
            pairs = mesh_data.read_pairs(obj, self.request.keys, self.request.base)
        except InputError as error:
            raise InputError(f"'{obj.name}' was changed meanwhile; nothing was written. {error}") from error
        if not all(_same(pair, self.task.pairs[ends]) for ends, pair in pairs.items()):
            raise InputError(f"'{obj.name}' was changed meanwhile; nothing was written. Bake again.")
        return obj


def located(name: str, session_uid: int) -> bpy.types.Object | None:
    """The object that once had this name, even if it was renamed or changed; None if it was deleted."""
    obj = bpy.data.objects.get(name)
    if obj is not None and obj.session_uid == session_uid:
        return obj
    return next((obj for obj in bpy.data.objects if obj.session_uid == session_uid), None)


def plan_maps(obj: bpy.types.Object | None, request: BakeRequest) -> Plan:
    """Plan to compute the map of every two consecutive keys again.

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
    """Plan the in-betweens of two or more keys; stored maps that still match the keys are used again.

    Raises
    ------
    InputError
        If the object, the keys or the settings cannot be used.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ...solver.fit.storage import why_unusable
    from ...solver.frames.task import Task

    obj = checks.require_object(obj)
    keys = keys_of(obj)
    record = Record.read(keys)
    checks.require_keys(keys, request.keys)
    request = request.timed
    if request.play_on == "auto":
        request = replace(request, play_on="key" if _can_play(keys, request) else "slider")
    checks.require_control(keys, request.keys, request.base)
    pairs = mesh_data.read_pairs(obj, request.keys, request.base)
    chain = _chain(obj, record, request)
    shape_keys.require_writable(obj, chain, request.keyframes)
    play = request.play_options
    play = replace(play, also_at=(*play.also_at, *Sculpted.of(obj, chain).places))
    same = {"tolerance": play.tolerance, "more": play.more, "count": play.count}
    if (play.tolerance > 0.0 or play.more) and same.items() <= chain.request.items():
        # With the same aim, a re-bake keeps all steps, so that their keys can stay.
        play = replace(play, also_at=(*play.also_at, *chain.places[1:-1]))
    usable, notes = {}, opened_seams(pairs)
    for ends, pair in pairs.items():
        data = record.kept_map(keys, kept_map(ends, pair, request.fit_options))
        problem = None if data is None else why_unusable(data)
        if problem is not None:
            notes.append(f"The stored map from '{ends[0]}' to '{ends[1]}' {problem} and was computed again.")
        elif data is not None:
            usable[ends] = data
    collider = colliders.read_colliders(obj, request.colliders, request.keys)
    task = Task(
        pairs, request.keys, request.fit_options, request.frame_options, kept=usable, collider=collider, play=play
    )
    return Plan(request, task, obj.session_uid, obj.name, tuple(notes))


def write_maps(plan: Plan, outcome: Outcome) -> None:
    """Store the maps with the object's keys, for later bakes.

    Raises
    ------
    InputError
        If the object was deleted or changed during the work; nothing is written then.
    """
    keys = keys_of(plan.find_object())
    record = Record.read(keys)
    with ExitStack() as undo:
        _keep_maps(keys, record, plan, outcome, undo)
        record.write(keys, undo)
        undo.pop_all()


def write_bake(plan: Plan, outcome: Outcome) -> BakeResult:
    """Write the frames as shape keys that one key or slider plays.

    Raises
    ------
    InputError
        If the object was deleted or changed during the work; nothing is written then.
    """
    obj, request, bake = plan.find_object(), plan.request, outcome.bake
    assert bake is not None
    played = bake.report.played
    assert played is not None
    keys = keys_of(obj)
    record = Record.read(keys)
    chain = _chain(obj, record, request)
    shape_keys.require_writable(obj, chain, request.keyframes)
    steps = shape_keys.Steps(tuple(bake.times.tolist()), tuple(played.corners))
    if chain.on_key:
        shapes = chain_shapes.offsets_by_step(obj, steps.places, bake.frames)
    else:
        shapes = chain_shapes.shapes_by_step(obj, _steps_of_keys(steps.places, request), bake.frames)
    sculpted = Sculpted.of(obj, chain)
    sculpted.require_among(steps.places)
    shapes, made, kept = sculpted.kept(steps.places, shapes)
    # Looked for while the chain still has the steps of its earlier bake.
    unknown = [*unknown_inbetweens(keys, chain, record.chains)] if chain.on_key else []

    with shape_keys.chain_written(obj, chain, shapes, steps, request.keyframes, request.frame_options.via_at) as (
        undo,
        said,
    ):
        control = chain_keys.control_of(obj, chain)
        owner = obj.name if control.is_key else control.owner.name
        notes = [*plan.notes, *bake.report.notes, *said, *kept]
        notes += own_keyframes.mute(keys, chain, undo) if request.keyframes is not None else []
        notes += colliders.changed_since(obj, request.colliders, request.keys, plan.task.collider)
        notes += double_motion(obj, chain, record.chains)
        notes += unknown
        left = sentence(leftovers(keys, {*made_keys(keys), *chain.keys.values()}))
        notes += [left] if left else []
        if control.is_key and keys.key_blocks[control.name].mute:
            notes.append(f"'{control.name}' is muted, and its in-betweens with it; unmute it to see them play.")
        if obj.show_only_shape_key:
            notes.append(f"'{obj.name}' shows only its active key; unpin it to see the in-betweens play.")
        report = {
            "object": obj.name,
            "from": request.keys[0],
            "via": list(request.keys[1:-1]),
            "to": request.keys[-1],
            "count": len(steps.places) - len(request.keys),
            "places": list(steps.places),
            "keys": list(chain.keys.values()),
            "slider": control.name,
            "on_key": chain.on_key,
            "slider_object": owner,
            **bake.report.as_json(),
            "notes": notes,
        }
        chain.request, chain.mirror_of = request.remembered(), ""
        chain.digests = tuple(digest(keys.key_blocks[name]) for name in request.keys)
        chain.result = Summary.of_report(bake.report, steps.places, len(request.keys), notes)
        record.chains.append(record.chains.pop(record.chains.index(chain)))  # the newest is the last
        _keep_maps(keys, record, plan, outcome, undo)
        bookkeeping.remember(obj, record, chain, bake.measures, made, undo)
        result = BakeResult(control.name, owner, tuple(chain.keys.values()), tuple(notes), report)
    return result


def kept_map(ends: tuple[str, str], pair: KeyPair, options: FitOptions) -> KeptMap:
    """The entry of the record for the map of a pair that was made with these options."""
    from ...solver.fit.storage import fingerprint

    return KeptMap(*ends, f"{fingerprint(pair)} {options.identity}")


def _same(pair: KeyPair, read: KeyPair) -> bool:
    arrays = ("key0", "key1", "faces", "edges", "polygons")
    return all(np.array_equal(getattr(pair, name), getattr(read, name)) for name in arrays)


def _keep_maps(keys: bpy.types.Key, record: Record, plan: Plan, outcome: Outcome, undo: ExitStack) -> None:
    for ends, data in outcome.fits.items():
        record.keep_map(keys, kept_map(ends, plan.task.pairs[ends], plan.request.fit_options), data, undo)


def _can_play(keys: bpy.types.Key, request: BakeRequest) -> bool:
    """Whether the value of the last key can play the request.

    Keyframes at inner keys need a control of their own where that value has a driver or keyframes.
    """
    has_inner = request.keyframes is not None and len(request.keyframes) > 2
    if has_inner and own_keyframes.is_controlled(keys, request.keys[-1]):
        return False
    return checks.control_problem(keys, request.keys, request.keys[0]) is None


def _chain(obj: bpy.types.Object, record: Record, request: BakeRequest) -> Chain:
    """The entry of these keys in the record; a new one is added if there is none."""
    on_key = request.keys[-1] if request.play_on == "key" else ""
    mode = request.frame_options.mode
    chain = record.chain_on_key(on_key) if on_key else record.chain(request.keys, mode)
    if chain is None:
        taken = {*obj.keys(), *(other.slider for other in record.chains)}
        mark = f"_{mode}" if record.chain(request.keys) is not None and not on_key else ""
        label = names.chain_label((on_key,) if on_key else request.keys, taken, mark)
        chain = Chain(request.keys, label, on_key=on_key)
        record.chains.append(chain)
    chain.through = request.keys
    return chain


def _steps_of_keys(places: tuple[float, ...], request: BakeRequest) -> dict[int, str]:
    """Names of the request's keys, by the step that shows them."""
    from ...solver.frames.key_times import KeyTimes

    at_keys = KeyTimes.of(request.frame_options, len(request.keys) - 1).at
    steps = np.abs(np.array(places)[:, None] - at_keys).argmin(axis=0)
    return dict(zip(steps.tolist(), request.keys, strict=True))
