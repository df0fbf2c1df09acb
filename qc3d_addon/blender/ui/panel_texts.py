# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in panels."""

from __future__ import annotations

import textwrap

import bpy

_MARGINS, _LETTER = 85.0, 6.2  # tabs, borders and icon; a letter on average


def draw_sentence(context: bpy.types.Context, layout: bpy.types.UILayout, sentence: str, icon: str = 'INFO') -> None:
    """Draw a sentence over as many lines as the width of the sidebar asks for; Blender would cut it."""
    points = context.region.width / context.preferences.system.ui_scale
    width = max(16, int((points - _MARGINS) / _LETTER))
    lines = layout.column(align=True)
    for index, line in enumerate(textwrap.wrap(sentence, width)):
        lines.label(text=line, icon=icon if index == 0 else 'BLANK1')
