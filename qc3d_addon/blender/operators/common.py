# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the operators share: when their buttons are disabled, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import bpy
from bpy.props import StringProperty

from ...solver.errors import InputError
from ..bake import jobs
from ..kinds import keys_of, present
from ..properties import panel_keys, settings_of
from ..store import checks
from ..store.records import Chain, Record

# What an operator says of itself when it ends, or goes on.
Status = set[Literal['RUNNING_MODAL', 'CANCELLED', 'FINISHED', 'PASS_THROUGH', 'INTERFACE']]

if TYPE_CHECKING:
    SLIDER = str
    OperatorMixin = bpy.types.Operator  # to mypy what operators share is an operator; to Blender each of them is
else:
    SLIDER = StringProperty(
        name="Slider", description="The slider of the in-betweens; the newest where left out", options={'SKIP_SAVE'}
    )
    OperatorMixin = object


def poll_active_object(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the active object can be worked on now; where not, the disabled button says why."""
    return _poll(operator, checks.object_problem(context.active_object) or jobs.busy_problem())


def poll_panel_keys(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the keys that the panel shows can be used; a script, which names its own, is never stopped."""
    if context.region is None or context.region.type != 'UI':
        return True
    obj = present(context.active_object)
    return _poll(operator, checks.keys_problem(keys_of(obj), panel_keys(settings_of(obj))))


def poll_chains(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the active object has in-betweens to work on now."""
    if not poll_active_object(operator, context):
        return False
    return _poll(operator, checks.chains_problem(present(context.active_object)))


def chosen_chain(obj: bpy.types.Object | None, slider: str) -> Chain:
    """The in-betweens of a slider, the newest where the name is empty.

    Raises
    ------
    InputError
        If the object has none of that name.
    """
    obj = checks.require_object(obj)
    chain = Record.read(keys_of(obj)).chain_of_slider(slider)
    if chain is None:
        which = f" with the slider '{slider}'" if slider else ""
        raise InputError(f"'{obj.name}' has no in-betweens{which}; bake some first.")
    return chain


def _poll(operator: type[bpy.types.Operator], problem: str | None) -> bool:
    if problem is not None:
        operator.poll_message_set(problem)
    return problem is None
