# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the operators share: when their buttons are disabled, and why."""

from __future__ import annotations

import bpy

from .. import checks, jobs
from ..properties import key_names


def poll_active_object(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the active object can be worked on now; where not, the disabled button says why."""
    return _poll(operator, checks.object_problem(context.active_object) or jobs.busy_problem())


def poll_panel_keys(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the keys that the panel shows can be used; a script, which names its own, is never stopped."""
    if context.region is None or context.region.type != 'UI':
        return True
    obj = context.active_object
    return _poll(operator, checks.keys_problem(obj.data.shape_keys, key_names(obj.qc3d)))


def _poll(operator: type[bpy.types.Operator], problem: str | None) -> bool:
    if problem is not None:
        operator.poll_message_set(problem)
    return problem is None
