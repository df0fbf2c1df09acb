# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the operators share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy

from .. import checks

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...solver.pipeline import Progress

STAGES = ("mesh", "locate", "fit", "factor", "frames")


def poll_active_object(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the active object can be baked; where not, the disabled button says why."""
    problem = checks.object_problem(context.active_object)
    if problem is not None:
        operator.poll_message_set(problem)
    return problem is None


@contextmanager
def progress_shown(context: bpy.types.Context) -> Iterator[Callable[[Progress], None]]:
    """Show the progress at the mouse pointer while the block runs."""
    manager = context.window_manager
    manager.progress_begin(0.0, float(len(STAGES)))
    try:
        yield lambda progress: manager.progress_update(STAGES.index(progress.stage) + progress.fraction)
    finally:
        manager.progress_end()
