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
_FEWEST = 16  # letters in a line, however narrow the sidebar


def draw_sentence(
    context: bpy.types.Context, layout: bpy.types.UILayout, sentence: str, icon: IconItems = 'INFO'
) -> None:
    """Draw a sentence, wrapped to the width of the sidebar; Blender itself would cut it off."""
    lines = layout.column(align=True)
    for index, line in enumerate(textwrap.wrap(sentence, max(_FEWEST, _letters(context)))):
        lines.label(text=line, icon=icon if index == 0 else 'BLANK1')


def fitted(context: bpy.types.Context, name: str, share: float = 1.0) -> str:
    """A name as long as fits into a part of the sidebar's width; a longer one loses its middle, not its end."""
    most = max(_FEWEST // 2, int(share * _letters(context)))
    if len(name) <= most:
        return name
    return f"{name[: most // 2]}…{name[len(name) - (most - 1) // 2 :]}"


def _letters(context: bpy.types.Context) -> int:
    """Number of letters in a line of the sidebar, beside an icon."""
    region, preferences = present(context.region), present(context.preferences)
    return int((region.width / preferences.system.ui_scale - _MARGINS) / _LETTER)
