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

STAGES_OF_A_MAP = 3  # mesh, locate, fit
STAGES_OF_A_BAKE = ("factor", "frames")


def poll_active_object(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the active object can be baked; where not, the disabled button says why."""
    problem = checks.object_problem(context.active_object)
    if problem is not None:
        operator.poll_message_set(problem)
    return problem is None


@contextmanager
def progress_shown(context: bpy.types.Context, maps: int) -> Iterator[Callable[[Progress], None]]:
    """Show the progress at the mouse pointer while the block runs, which makes up to so many maps and then frames."""
    manager = context.window_manager
    begun: list[str] = []

    def show(progress: Progress) -> None:
        if progress.stage in STAGES_OF_A_BAKE:
            done = STAGES_OF_A_MAP * maps + STAGES_OF_A_BAKE.index(progress.stage)
        else:
            if not begun or begun[-1] != progress.stage:
                begun.append(progress.stage)
            done = len(begun) - 1
        manager.progress_update(done + progress.fraction)

    manager.progress_begin(0.0, float(STAGES_OF_A_MAP * maps + len(STAGES_OF_A_BAKE)))
    try:
        yield show
    finally:
        manager.progress_end()
