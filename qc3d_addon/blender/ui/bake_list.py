# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of an object's bakes."""

from __future__ import annotations

import bpy

from ..keys.chain_keys import control_of
from ..kinds import expect, keys_of, present
from ..properties import newest_first, settings_of
from ..store.chain import Chain
from .panel_texts import fitted

_LEAST_ROWS, _MOST_ROWS = 2, 5
_OF_NAME, _OF_ICON = 0.65, 0.2  # of the width of a row


class QC3D_UL_bakes(bpy.types.UIList):
    """A row for each bake: its control and the value of the control.

    Blender can list only its own collections, and the record of bakes is none. Therefore the list is drawn over the
    shape keys: the first key stands for the first row, and so on.
    """

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        data: object,
        item: object,
        icon: int | None,
        active_data: object,
        active_property: str | None,
        index: int | None = 0,
        flt_flag: int | None = 0,
    ) -> None:
        obj = expect(bpy.types.Object, getattr(active_data, "id_data", None))
        chains = newest_first(obj)
        if index is None or index >= len(chains):
            return
        control = control_of(obj, chains[index])
        row = layout.split(factor=_OF_NAME)
        name = fitted(context, control.name, _OF_NAME - _OF_ICON)
        row.label(text=name, icon='SHAPEKEY_DATA' if control.is_key else 'PROPERTIES')
        if control.problem is None:
            row.prop(*control.shown, text="", slider=True)
        else:
            row.label(text="", icon='ERROR')

    def filter_items(
        self, context: bpy.types.Context, data: object, property: str | None
    ) -> tuple[list[int], list[int]]:
        chains, wanted = newest_first(present(context.active_object)), self.filter_name.lower()
        names = [(chain.on_key or chain.slider).lower() for chain in chains]
        flags = [self.bitflag_filter_item if wanted in name else 0 for name in names]
        rows = len(expect(bpy.types.Key, data).key_blocks)
        return [*flags[:rows], *[self.bitflag_item_never_show] * (rows - len(chains))], []


def draw(layout: bpy.types.UILayout, obj: bpy.types.Object, chains: list[Chain]) -> Chain:
    """Draw the list if there are several chains, given newest first; returns the chosen one."""
    settings, keys = settings_of(obj), keys_of(obj)
    if len(chains) > 1:
        rows = min(max(len(chains), _LEAST_ROWS), _MOST_ROWS)
        layout.template_list(
            QC3D_UL_bakes.__name__, "", keys, "key_blocks", settings, "row", rows=rows, maxrows=_MOST_ROWS
        )
    return chains[settings.row]
