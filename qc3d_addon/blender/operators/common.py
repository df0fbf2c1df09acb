# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by the operators: when their buttons are disabled and why, and which chain they work on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import bpy
from bpy.props import StringProperty

from ...solver.errors import InputError
from .. import live_scrub
from ..bake import jobs
from ..keys import straight
from ..kinds import keys_of, present
from ..properties import panel_keys, settings_of
from ..store import checks
from ..store.chain import Chain
from ..store.records import Record

# The return values of an operator.
Status = set[Literal['RUNNING_MODAL', 'CANCELLED', 'FINISHED', 'PASS_THROUGH', 'INTERFACE']]

if TYPE_CHECKING:
    SLIDER = str
    OperatorMixin = bpy.types.Operator  # for mypy only
else:
    SLIDER = StringProperty(
        name="Slider",
        description="Name of the slider that plays the in-betweens; by default the newest",
        options={'SKIP_SAVE'},
    )

    class OperatorMixin:
        """Nothing: Blender wants just the final classes to be operators."""


_errors: list[str] = []  # the last one that an operator reported since Blender was started


def report_error(operator: bpy.types.Operator, sentence: str) -> None:
    """Show an error, and remember it for bug reports."""
    _errors[:] = [f"{operator.bl_idname}: {sentence}"]
    operator.report({'ERROR'}, sentence)


def last_error() -> str | None:
    """The last error that was shown, after the operator's name."""
    return _errors[-1] if _errors else None


def end_previews() -> None:
    """Let the file show what was baked, before it is worked on: no moments between, and no straight blend."""
    live_scrub.end()
    straight.end()


def poll_active_object(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the active object can be worked on now; if not, the disabled button says why."""
    return _poll(operator, checks.object_problem(context.active_object) or jobs.busy_problem())


def poll_panel_keys(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the keys in the panel can be used; scripts pass their own keys and are never stopped here."""
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
    """The in-betweens of a slider; the newest if the name is empty.

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
