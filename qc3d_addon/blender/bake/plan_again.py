# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans for chains that were baked before: with one more in-between, or densely for a preview."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...solver.errors import InputError
from ..keys import chain_keys
from ..kinds import keys_of
from ..store import checks
from ..store.chain import Chain
from .plan import Plan, plan_bake
from .request import PREVIEW_STEPS, BakeRequest

_DIGITS = 4  # of places that the user sets by hand
_LEAST_APART = 0.01  # of two in-betweens, one of which the user asks for


def request_again(obj: bpy.types.Object | None, chain: Chain) -> BakeRequest:
    """The request that a chain was baked with, to bake it again.

    Raises
    ------
    InputError
        If the object cannot be used, or keys that the chain goes through no longer exist.
    """
    problem = checks.chain_problem(keys_of(checks.require_object(obj)), chain)
    if problem is not None:
        raise InputError(problem)
    return BakeRequest.again(chain.through, chain.request)


def plan_one_more(obj: bpy.types.Object | None, chain: Chain) -> Plan:
    """Plan a chain again with one more in-between, where its control is now; later bakes of it have it too.

    Raises
    ------
    InputError
        If the object or the keys cannot be used, or the control is not between two in-betweens.
    """
    request = request_again(obj, chain)
    control = chain_keys.control_of(checks.require_object(obj), chain)
    control.require()
    place = round(control.value, _DIGITS)
    if not 0.0 < place < 1.0:
        raise InputError(f"'{control.name}' is at {place:.2f}; set it between 0 and 1, where the in-between is to be.")
    nearest = min(chain.places, key=lambda known: abs(known - place))
    if abs(nearest - place) < _LEAST_APART:
        what = "an end" if nearest in (0.0, 1.0) else "an in-between"
        raise InputError(f"'{control.name}' is at {place:.3f}, and there is {what} at {nearest:.3f}; set it elsewhere.")
    return plan_bake(obj, replace(request, also_at=(*request.also_at, place)))


def plan_preview(obj: bpy.types.Object | None, chain: Chain) -> Plan:
    """Plan the frames of a baked chain for live scrub: densely and evenly spaced, without easing.

    Raises
    ------
    InputError
        If the object or the keys can no longer be used.
    """
    from ...solver.frames.key_times import KeyTimes

    request = request_again(obj, chain)
    chain_keys.control_of(checks.require_object(obj), chain).require()
    plan = plan_bake(obj, request)
    key_times = KeyTimes.of(request.frame_options, len(request.keys) - 1).before_easing
    even = replace(request.frame_options, easing="linear", via_at=tuple(key_times.at[1:-1].tolist()))
    times = key_times.between(PREVIEW_STEPS - 1)
    return replace(plan, task=replace(plan.task, frame_options=even, times=times, play=None))
