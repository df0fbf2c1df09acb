# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the 3D view shows a heat map: its shading, and a legend in the corner."""

from __future__ import annotations

import contextlib
from typing import cast

import bpy

from ..kinds import expect, present
from ..store import id_properties
from . import heat_map
from .colors import Scale

_WIDTH, _HEIGHT, _MARGIN, _TEXT = 220, 14, 24, 12  # pixels at a resolution scale of 1
_SHADING = "qc3d_shading"  # property of the screen with the previous shading

_handles: list[object] = []


def enter(context: bpy.types.Context) -> None:
    """Let the 3D view, if there is one, show color attributes."""
    shading, screen = _shading(context), context.screen
    if shading is None or screen is None:
        return
    if (shading.type, shading.color_type) != ('SOLID', 'VERTEX'):
        screen[_SHADING] = [shading.type, shading.color_type]
    shading.type = 'SOLID'
    shading.color_type = 'VERTEX'


def leave(context: bpy.types.Context) -> None:
    """Restore the previous shading of the view."""
    shading, screen = _shading(context), context.screen
    if shading is None or screen is None or not id_properties.has(screen, _SHADING):
        return
    before = screen.pop(_SHADING)
    shading.type = 'SOLID'
    with contextlib.suppress(TypeError, ValueError):  # not what ``enter`` stored: the view then stays in Solid
        kind, colors = before
        shading.color_type = colors
        shading.type = kind


def _shading(context: bpy.types.Context) -> bpy.types.View3DShading | None:
    """The shading of the 3D view, None without one."""
    space = context.space_data
    if space is None or space.type != 'VIEW_3D':
        return None
    return cast(bpy.types.SpaceView3D, space).shading


def register() -> None:
    """Draw the legend in every 3D view."""
    if not bpy.app.background:
        _handles.append(bpy.types.SpaceView3D.draw_handler_add(_draw, (), 'WINDOW', 'POST_PIXEL'))


def unregister() -> None:
    """Stop drawing it."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), 'WINDOW')


def _draw() -> None:
    state = heat_map.shown(bpy.context.active_object)
    if state is None:
        return
    view = expect(bpy.types.SpaceView3D, bpy.context.space_data)
    if not present(view.overlay).show_overlays:
        return
    scale = state.scale
    size = present(bpy.context.preferences).system.ui_scale
    _draw_bar(scale, size)
    _draw_texts(scale, size)


def _draw_bar(scale: Scale, size: float) -> None:
    import gpu
    from gpu_extras.batch import batch_for_shader

    left, bottom = _MARGIN * size, (_MARGIN + _TEXT * 1.5) * size
    last = len(scale.colors) - 1
    corners, colors = [], []
    for number, color in enumerate(scale.colors):
        x = left + _WIDTH * size * number / last
        corners += [(x, bottom), (x, bottom + _HEIGHT * size)]
        colors += [(*color, 1.0)] * 2
    shader = gpu.shader.from_builtin('SMOOTH_COLOR')
    batch_for_shader(shader, 'TRI_STRIP', {"pos": corners, "color": colors}).draw(shader)


def _draw_texts(scale: Scale, size: float) -> None:
    import blf

    font = 0
    blf.size(font, _TEXT * size)
    blf.color(font, 0.95, 0.95, 0.95, 1.0)
    blf.enable(font, blf.SHADOW)
    blf.shadow(font, 3, 0.0, 0.0, 0.0, 0.8)
    texts = [(_MARGIN + place * _WIDTH, float(_MARGIN), text, place) for place, text in scale.ticks]
    texts.append((_MARGIN, _MARGIN + _TEXT * 1.5 + _HEIGHT + 6, scale.title, 0.0))
    for x, y, text, part in texts:
        width, _ = blf.dimensions(font, text)
        blf.position(font, x * size - part * width, y * size, 0.0)
        blf.draw(font, text)
    blf.disable(font, blf.SHADOW)
