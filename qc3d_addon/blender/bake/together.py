# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes several objects of one character in one map, so that lashes stay on lids and clothes on skin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...solver.arrays import Floats
from ...solver.errors import InputError
from .. import compat
from ..keys import chain_keys, drivers
from ..keys.control import Control
from ..kinds import keys_of, present
from ..store import checks
from ..store.evaluation import world_matrices
from ..store.records import Record
from .plan import Plan, plan_bake, write_bake
from .request import BakeRequest, BakeResult

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome, Task
    from ...solver.frames.together import Together


@dataclass(frozen=True)
class JointPlan:
    """What to compute for several objects at once.

    Parameters
    ----------
    plans
        Plan of each object by itself, the active one first.
    together
        The joined meshes, in the coordinates of the active object.
    task
        The task for the joined meshes.
    """

    plans: list[Plan]
    together: Together
    task: Task


def plan_together(objects: Sequence[bpy.types.Object], request: BakeRequest) -> JointPlan:
    """Plan the in-betweens of several objects that have the same keys.

    Parameters
    ----------
    objects
        The objects, without repetitions.
    request
        The request for all of them.

    Raises
    ------
    InputError
        If one cannot be baked, shares its mesh with another, or has the scale 0 along an axis.
    """
    from ...solver.frames.task import Task
    from ...solver.frames.together import PlacedMesh, Together

    plans: list[Plan] = []
    for number, obj in enumerate(objects):
        twin = next((other for other in objects[:number] if other.data == obj.data), None)
        if twin is not None:
            raise InputError(f"'{twin.name}' and '{obj.name}' share one mesh; bake only one of them.")
        try:
            plans.append(plan_bake(obj, request))
        except InputError as error:
            raise InputError(f"'{obj.name}' cannot be baked with the others. {error}") from error
    matrices = _matrices(objects)
    seen_from = np.linalg.inv(matrices[0])
    placed = [
        PlacedMesh(plan.task.pairs, seen_from @ matrix) for plan, matrix in zip(plans, matrices, strict=True)
    ]
    together = Together(placed)
    first = plans[0].task
    assert first.play is not None
    places = sorted({place for plan in plans if plan.task.play for place in plan.task.play.also_at})
    play = replace(first.play, also_at=tuple(places))
    task = Task(
        together.pairs, first.through, first.fit_options, first.frame_options, collider=first.collider, play=play
    )
    return JointPlan(plans, together, task)


def write_together(plan: JointPlan, outcome: Outcome, one_control: bool) -> list[BakeResult]:
    """Write the in-betweens of each object.

    Parameters
    ----------
    one_control
        Whether the control of the first object drives those of the others, unless something else drives them.

    Raises
    ------
    InputError
        If one of the objects was deleted or changed during the work; nothing is written then.
    """
    from ...solver.frames.task import Outcome as OwnOutcome

    assert outcome.bake is not None
    for one in plan.plans:
        one.find_object()
    bakes = plan.together.apart(outcome.bake, plan.task.frame_options, plan.task.through)
    results = []
    for one, bake in zip(plan.plans, bakes, strict=True):
        others = ", ".join(f"'{other.object_name}'" for other in plan.plans if other is not one)
        said = f"Baked together with {others}; Re-Bake bakes '{one.object_name}' by itself." if others else ""
        noted = replace(one, notes=(*one.notes, said)) if said else one
        results.append(write_bake(noted, OwnOutcome({}, bake)))
    if one_control:
        leader, *followers = [_control(one) for one in plan.plans]
        for follower in followers:
            follow(follower, leader)
    return results


def objects_with_keys(
    active: bpy.types.Object, others: Sequence[bpy.types.Object], names: Sequence[str]
) -> list[bpy.types.Object]:
    """The active object and those others that have shape keys of all these names, one object for each mesh."""
    found = {active.data: active}
    for obj in others:
        if checks.object_problem(obj) is None and all(name in keys_of(obj).key_blocks for name in names):
            found.setdefault(obj.data, obj)
    return list(found.values())


def follow(follower: Control, leader: Control) -> None:
    """Drive a control by another one, unless it already has a driver or keyframes."""
    animation = follower.owner.animation_data
    if animation is not None and animation.drivers.find(follower.path) is not None:
        return
    if follower == leader or not follower.is_there:
        return
    drivers.read(present(compat.new_driver(follower.owner, follower.path).driver), leader)


def _control(plan: Plan) -> Control:
    obj = plan.find_object()
    record = Record.read(keys_of(obj))
    return chain_keys.control_of(obj, record.chains[-1])


def _matrices(objects: Sequence[bpy.types.Object]) -> list[Floats]:
    matrices = world_matrices(objects)
    for obj, matrix in zip(objects, matrices, strict=True):
        if not abs(np.linalg.det(matrix[:3, :3])) > 0.0:
            raise InputError(f"'{obj.name}' has the scale 0 along an axis; set another scale.")
    return matrices
