# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes correction keys for shape keys that are on at once, over the whole range of their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...solver.arrays import Floats
from ...solver.errors import InputError
from ..bake.plan import located
from ..keys.sides import whole_of
from ..kinds import keys_of
from ..store import checks, combined_keys
from ..store.combined_keys import Combined
from . import correction_keys
from .halves import completed
from .probe import probed

if TYPE_CHECKING:
    from ...solver.combinations.corrections import Corrected, Corrections
    from ...solver.combinations.mirrored import MirroredShapes
    from ...solver.settings import FitOptions
    from ...solver.support.progress import OnProgress

_MOST_KEYS = 3


@dataclass(frozen=True)
class Made:
    """The result of combining keys.

    Parameters
    ----------
    combined : Combined
    is_sculpted : bool
        Whether the user had sculpted a key for the combination, which stays as it is.
    crossings : int
        Largest number of pairs of triangles that cross in a corrected shape but in none of the keys.
    off : float
        Largest distance of the plain sum from the corrected shape, over the size.
    """

    combined: Combined
    is_sculpted: bool
    crossings: int
    off: float

    @property
    def text(self) -> str:
        """One sentence."""
        crosses = f", {self.crossings} pairs of triangles cross" if self.crossings else ""
        own = "; your own shape for all of them stays" if self.is_sculpted else ""
        return (
            f"{self.combined.label}: {len(self.combined.made)} keys correct the sum, which was off by {self.off:.1%} "
            f"of the size{crosses}{own}."
        )


@dataclass(frozen=True)
class CombinationPlan:
    """What to compute for keys that are on at once, and what to compare when it is written.

    Parameters
    ----------
    chosen : tuple of str
        Names of the keys.
    task : Corrections
    mesh : MirroredShapes
        The mesh whose shapes are computed.
    shown : list of (n, 3)
        What the keys show now for each combination of values of the task.
    object_id, object_name
        See ``bake.plan.Plan``.
    digests : tuple of str
        Of the base and the keys, as they are now.
    """

    chosen: tuple[str, ...]
    task: Corrections
    mesh: MirroredShapes
    shown: list[Floats]
    object_id: int
    object_name: str
    digests: tuple[str, ...]

    def find_object(self) -> bpy.types.Object:
        """The object, after checking that the outcome can still be written to it.

        Raises
        ------
        InputError
            If it was deleted, is being edited, or its keys have changed since the plan was made.
        """
        obj = located(self.object_name, self.object_id)
        if obj is None:
            raise InputError(f"'{self.object_name}' was deleted meanwhile; nothing was written.")
        checks.require_object(obj)
        try:
            _require(obj, self.chosen)
        except InputError as error:
            raise InputError(f"'{obj.name}' was changed meanwhile; nothing was written. {error}") from error
        if combined_keys.digests_of(keys_of(obj), self.chosen) != self.digests:
            raise InputError(f"'{obj.name}' was changed meanwhile; nothing was written. Combine again.")
        return obj


def plan_combination(
    obj: bpy.types.Object | None,
    chosen: Sequence[str],
    find_order: bool = True,
    options: FitOptions | None = None,
) -> CombinationPlan:
    """Plan the correction keys for some keys of an object.

    The keys themselves, their in-betweens, and a key that the user has sculpted for their combination stay as they are.
    If there is such a key, the corrections lead to it.

    Parameters
    ----------
    obj
    chosen
        Names of two or three keys with the same base.
    find_order
        Whether to find the outer key; otherwise the keys are named from the outermost to the innermost.
    options
        Options of the fit that keeps shapes from crossing themselves.

    Raises
    ------
    InputError
        If the keys cannot be combined, or one that would be written is locked.
    """
    # Imported where it is used: scipy would make Blender start slower.
    from ...solver.combinations.corrections import Corrections
    from ...solver.settings import FitOptions

    obj = checks.require_object(obj)
    keys = keys_of(obj)
    _require(obj, chosen)
    known = combined_keys.read(keys)
    made = {name for one in known for name, _ in one.made}
    own = {name for name, _ in earlier.made} if (earlier := _earlier(known, chosen)) is not None else set()
    correction_keys.require_unlocked(keys, own)
    count = len(chosen)
    grid = np.array(list(product(range(len(correction_keys.PLACES)), repeat=count)))
    values = np.array(correction_keys.PLACES)
    with probed(obj, chosen, made) as shown:
        alone = [shown((place * np.eye(count)[key]).tolist()) for key in range(count) for place in values]
        ends = shown([0.0] * count), shown([1.0] * count)
    with probed(obj, chosen, own) as shown:
        present = [shown(values[places].tolist()) for places in grid]
    mesh = completed(obj, [*ends, *alone])
    base, sculpted, *others = mesh.shapes
    shapes = np.stack(others).reshape(count, len(correction_keys.PLACES), *base.shape)
    task = Corrections(
        base, shapes, sculpted, grid, values, mesh.faces, mesh.edges, find_order, options or FitOptions()
    )
    digests = combined_keys.digests_of(keys, chosen)
    return CombinationPlan(tuple(chosen), task, mesh, present, obj.session_uid, obj.name, digests)


def write_combination(plan: CombinationPlan, corrected: Corrected) -> Made:
    """Write the correction keys: all of them or, if anything fails, none.

    Raises
    ------
    InputError
        If the object was deleted or changed during the work, or a key that would be written is locked.
    """
    obj = plan.find_object()
    keys = keys_of(obj)
    known = combined_keys.read(keys)
    earlier = _earlier(known, plan.chosen)
    correction_keys.require_unlocked(keys, {name for name, _ in earlier.made} if earlier is not None else set())
    corrections = {}
    for places, shape, shown in zip(plan.task.places, corrected.shapes, plan.shown, strict=True):
        values = tuple(float(plan.task.values[places[key]]) for key in corrected.order)
        if not (corrected.is_sculpted and min(values) == 1.0):
            corrections[values] = plan.mesh.own(shape) - shown
    named = tuple(plan.chosen[number] for number in corrected.order)
    combined = correction_keys.write(obj, named, dict(sorted(corrections.items())), earlier, known)
    return Made(combined, corrected.is_sculpted, corrected.crossings, corrected.off)


def combine(
    obj: bpy.types.Object | None,
    chosen: Sequence[str],
    find_order: bool = True,
    options: FitOptions | None = None,
    on_progress: OnProgress | None = None,
) -> Made:
    """Plan, compute and write the correction keys in this process; see ``plan_combination``.

    Raises
    ------
    InputError
        If the keys cannot be combined, or one that would be written is locked; nothing is written then.
    """
    from ...solver.support.memory import machine_limit_mb
    from ...solver.support.progress import finish

    plan = plan_combination(obj, chosen, find_order, options)
    plan.task.require_memory(machine_limit_mb())
    return write_combination(plan, finish(plan.task.carried_out(), on_progress))


def _earlier(known: Sequence[Combined], chosen: Sequence[str]) -> Combined | None:
    return next((one for one in known if set(one.keys) == set(chosen)), None)


def _require(obj: bpy.types.Object, chosen: Sequence[str]) -> None:
    keys = keys_of(obj)
    if not 2 <= len(chosen) <= _MOST_KEYS:
        named = f"{len(chosen)} {'was' if len(chosen) == 1 else 'were'}"
        raise InputError(f"Combinations are of two or three keys, and {named} named; name those that are on at once.")
    twice = next((name for name in chosen if list(chosen).count(name) > 1), None)
    if twice is not None:
        raise InputError(f"'{twice}' is named twice; name different keys.")
    for name in chosen:
        if name not in keys.key_blocks:
            raise InputError(f"There is no shape key '{name}' on '{obj.name}'; choose from those of the mesh.")
    blocks = [keys.key_blocks[name] for name in chosen]
    if keys.reference_key in blocks:
        raise InputError(f"'{keys.reference_key.name}' is what the keys are relative to; choose others.")
    bases = {key.relative_key.name for key in blocks}
    if len(bases) > 1:
        raise InputError(f"The keys are relative to different ones, {' and '.join(sorted(bases))}; choose others.")
    if combined_keys.names_made(keys) & set(chosen):
        raise InputError("One of the keys corrects others itself; choose those that it corrects.")
    whole = whole_of(obj, chosen)
    if whole is not None:
        raise InputError(
            f"'{chosen[0]}' and '{chosen[1]}' add up to '{whole}', so there is nothing to correct; Split Key Left and "
            "Right gives them its in-betweens."
        )
