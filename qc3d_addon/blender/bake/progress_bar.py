# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the progress of the running job in the status bar and in the sidebars of the 3D views."""

from __future__ import annotations

from typing import Any

import bpy

from ..kinds import present
from . import jobs

CATEGORY = "QC3D"  # the tab of the panel


def draw_bar(layout: bpy.types.UILayout, job: jobs.Job) -> None:
    """A progress bar with the name of the stage in it."""
    layout.progress(text=f"{job.stage}, {job.fraction:.0%}", factor=job.fraction, type='BAR')


def show(context: bpy.types.Context) -> None:
    """Redraw the status bar and the sidebars with the progress of the job."""
    if context.workspace is not None:
        context.workspace.status_text_set(_draw_status)
    _redraw_sidebars()


def is_at(window: bpy.types.Window, x: int, y: int) -> bool:
    """Whether a place, in pixels from the window's bottom left, is where progress is shown: status bar or sidebar."""
    areas = window.screen.areas
    if y < min(area.y for area in areas):  # the status bar is below all of them, and is none
        return True
    return any(
        region.x <= x < region.x + region.width and region.y <= y < region.y + region.height
        for area in areas
        if area.type == 'VIEW_3D'
        for region in area.regions
        if region.type == 'UI' and getattr(region, "active_panel_category", CATEGORY) == CATEGORY
    )


def clear() -> None:
    """Give the status bar back to Blender and redraw the sidebars."""
    override: Any = bpy.context.temp_override  # the stubs of 5.2 know no block that it can be for
    for window in present(bpy.context.window_manager).windows:
        with override(window=window):  # the call redraws only the status bar of the context's window
            window.workspace.status_text_set(None)
    _redraw_sidebars()


def _draw_status(header: bpy.types.Header, context: bpy.types.Context) -> None:
    layout, job = present(header.layout), jobs.current()
    if job is not None:
        layout.label(text=job.label, icon='SHAPEKEY_DATA')
        bar = layout.row()
        bar.ui_units_x = 12
        draw_bar(bar, job)
        layout.label(text="  Cancel, with the mouse here", icon='EVENT_ESC')
    layout.separator_spacer()
    layout.template_reports_banner()
    layout.separator_spacer()
    layout.template_running_jobs()
    layout.template_status_info()


def _redraw_sidebars() -> None:
    for window in present(bpy.context.window_manager).windows:
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                for region in area.regions:
                    if region.type == 'UI':
                        region.tag_redraw()
