# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes many keys in one run, each played by its own value, and reports the result for each key."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import bpy
import numpy as np

from ...solver.errors import CanceledError, InputError, QC3DError
from ..keys import chain_keys
from ..kinds import keys_of
from ..store import checks, combined_keys
from ..store.records import Record
from ..store.renames import digest
from .plan import Plan, plan_bake, write_bake
from .request import BakeRequest

if TYPE_CHECKING:
    from ...solver.frames.many import Run
    from ...solver.frames.task import Outcome

# Relative to the size. A key whose motion leaves the straight blend by less needs no in-betweens.
STRAIGHT_ENOUGH = 1e-3

Ended = Literal["baked", "straight", "left", "failed"]


@dataclass(frozen=True)
class Verdict:
    """The result for one key.

    Parameters
    ----------
    key
        Name of the key.
    ended
        ``baked``; ``straight``: it needs no in-betweens; ``left``: there was nothing to do; ``failed``.
    text
        The result in words.
    report
        Report of the bake, as plain values; empty without one.
    """

    key: str
    ended: Ended
    text: str
    report: dict[str, Any]

    def __str__(self) -> str:
        return f"{self.key}: {self.text}"


def bakeable_keys(obj: bpy.types.Object | None) -> list[str]:
    """Names of the user's own keys of an object that can play in-betweens by their value: all except the Basis.

    Raises
    ------
    InputError
        If the object cannot be baked.
    """
    keys = keys_of(checks.require_object(obj))
    made = {key.name for chain in Record.read(keys).chains for key in chain_keys.owned_keys(keys, chain).values()}
    made |= combined_keys.names_made(keys)
    return [key.name for key in keys.key_blocks if key != keys.reference_key and key.name not in made]


def require_own_keys(obj: bpy.types.Object, names: Sequence[str]) -> list[str]:
    """The names without repetitions; raises InputError if one is not a key that can play in-betweens."""
    known, blocks = bakeable_keys(obj), keys_of(obj).key_blocks
    for name in names:
        if name not in blocks:
            raise InputError(f"There is no shape key '{name}' on '{obj.name}'; choose from those of the mesh.")
        if name not in known:
            raise InputError(f"'{name}' cannot play in-betweens: it is the Basis, or an in-between itself.")
    if not names:
        raise InputError(f"No shape key of '{obj.name}' is chosen; select some in the list of shape keys.")
    return list(dict.fromkeys(names))


def plan_key(
    obj: bpy.types.Object | None, name: str, choices: BakeRequest, memory_mb: float = 0.0
) -> Plan | Verdict:
    """The plan for a key, or the verdict if there is nothing to compute.

    Parameters
    ----------
    choices
        The request except for the keys; a chain that the key already plays keeps the keys that it goes through.
    """
    try:
        keys = keys_of(checks.require_object(obj))
        chain = Record.read(keys).chain_on_key(name)
        base = keys.key_blocks[name].relative_key.name
        through = chain.through if chain is not None and chain.through[0] == base else (base, name)
        via_at = chain.via_at if chain is not None and chain.through == through else ()
        frame_options = replace(choices.frame_options, via_at=via_at)
        request = replace(choices, keys=through, frame_options=frame_options, play_on="key", keyframes=None)
        if chain is not None and chain.through == through and chain.request == request.remembered():
            is_whole = chain_keys.owned_keys(keys, chain).keys() == chain.keys.keys()
            if is_whole and chain.digests == tuple(digest(keys.key_blocks[other]) for other in through):
                return Verdict(name, "left", "already baked, and its keys have not changed", {})
        plan = plan_bake(obj, request)
        plan.task.require_memory(memory_mb)
    except QC3DError as error:
        return Verdict(name, "failed", str(error), {})
    pair = next(iter(plan.task.pairs.values()))
    if len(plan.task.pairs) == 1 and np.array_equal(pair.key0, pair.key1):
        return Verdict(name, "left", f"has the same shape as '{base}'", {})
    return plan


def write_key(plan: Plan, outcome: Outcome | QC3DError) -> Verdict:
    """Write the in-betweens of a key unless it needs none; returns the result for the key."""
    name = plan.request.keys[-1]
    if isinstance(outcome, QC3DError):
        return Verdict(name, "left" if isinstance(outcome, CanceledError) else "failed", str(outcome), {})
    missed = _beyond_straight(plan, outcome)
    if missed < STRAIGHT_ENOUGH:
        return Verdict(name, "straight", f"straight is enough: {missed:.2%}", {})
    try:
        result = write_bake(plan, outcome)
    except QC3DError as error:
        return Verdict(name, "failed", str(error), {})
    return Verdict(name, "baked", _words(result.report), result.report)


@dataclass(frozen=True)
class ManyPlan:
    """What to compute for many keys of an object.

    Parameters
    ----------
    plans
        The plan of each key, or its verdict if there is nothing to compute.
    task
        The tasks of the plans, in one run.
    """

    plans: list[Plan | Verdict]
    task: Run

    def write(self, outcomes: Sequence[Outcome | QC3DError]) -> list[Verdict]:
        """Write the in-betweens of every key that has an outcome and needs them; the verdict of each key."""
        left = iter(outcomes)
        return [one if isinstance(one, Verdict) else write_key(one, next(left)) for one in self.plans]

    def locate(self) -> bpy.types.Object | None:
        """The object, even if it was renamed or changed; None if it was deleted or no key has a plan."""
        return next((one.locate() for one in self.plans if isinstance(one, Plan)), None)


def plan_keys(obj: bpy.types.Object, names: Sequence[str], choices: BakeRequest, memory_mb: float) -> ManyPlan:
    """Plan to bake keys of an object in one run, each played by its own value.

    Parameters
    ----------
    memory_mb
        Memory that the run may take, in megabytes; a key that would need more gets a verdict.

    Raises
    ------
    InputError
        If a name is that of no key that can play in-betweens, or there are none.
    """
    from ...solver.frames.many import Run

    plans = [plan_key(obj, name, choices, memory_mb) for name in require_own_keys(obj, names)]
    run = Run.of([one.task for one in plans if isinstance(one, Plan)], memory_mb)
    tasks = iter(run.tasks)
    return ManyPlan([replace(one, task=next(tasks)) if isinstance(one, Plan) else one for one in plans], run)


def summary(verdicts: Sequence[Verdict]) -> str:
    """One sentence about all keys."""
    ends = [verdict.ended for verdict in verdicts]
    counts = {ended: ends.count(ended) for ended in ("baked", "straight", "left")}
    failed = len(verdicts) - sum(counts.values())
    parts = [f"{counts['baked']} of {len(verdicts)} keys got in-betweens"]
    parts += [f"straight is enough for {counts['straight']}"] if counts["straight"] else []
    parts += [f"{counts['left']} were left as they are"] if counts["left"] else []
    parts += [f"{failed} cannot be baked"] if failed else []
    return f"{'; '.join(parts)}."


def _beyond_straight(plan: Plan, outcome: Outcome) -> float:
    """Largest distance of the motion from the straight blend, over the size; infinite with keys in between."""
    bake = outcome.bake
    if bake is None or len(plan.request.keys) > 2:
        return float("inf")
    times = bake.times[:, None, None]
    straight = (1.0 - times) * bake.frames[0] + times * bake.frames[-1]
    diagonal = next(iter(plan.task.pairs.values())).diagonal
    return float(np.linalg.norm(bake.frames - straight, axis=2).max(initial=0.0)) / diagonal


def _words(report: dict[str, Any]) -> str:
    """The number of in-betweens of a key, and their crossings and folds, in words."""
    count, crossings, folds = report["count"], report["crossings"], report["folds"]["frames"]
    words = f"{count} in-between{'' if count == 1 else 's'}"
    known = [crossed or 0 for crossed in crossings]
    if max(known):
        worst = int(np.argmax(known))
        words += f", crosses in {known[worst]} pairs at {report['places'][worst]:.2f}"
    elif report["played"]["crossings"]:
        words += f", crosses in {report['played']['crossings']} pairs between them"
    if folds and any(folds):
        words += f", {sum(folds)} folds"
    return words
