# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in panels."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import bpy

from ..kinds import present

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import IconItems

_MARGINS, _LETTER = 85.0, 6.2  # pixels: tabs, borders and icon; mean width of a letter


def draw_sentence(
    context: bpy.types.Context, layout: bpy.types.UILayout, sentence: str, icon: IconItems = 'INFO'
) -> None:
    """Draw a sentence, wrapped to the width of the sidebar; Blender itself would cut it off."""
    region, preferences = present(context.region), present(context.preferences)
    points = region.width / preferences.system.ui_scale
    width = max(16, int((points - _MARGINS) / _LETTER))
    lines = layout.column(align=True)
    for index, line in enumerate(textwrap.wrap(sentence, width)):
        lines.label(text=line, icon=icon if index == 0 else 'BLANK1')
