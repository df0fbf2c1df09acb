# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that splits a key into a left and a right one."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy
from bpy.props import FloatProperty, StringProperty

from ...solver.errors import QC3DError
from ..chains.split_sides import split_in_betweens
from ..keys import chain_keys
from ..keys.sides import sides_of
from ..keys.split import split_key
from ..kinds import keys_of
from ..store import checks
from ..store.records import Record
from .common import Status, end_previews, poll_active_object, report_error


class QC3D_OT_split_key(bpy.types.Operator):
    """Add a key for the left side of this key and one for the right side; added up, they are this key"""

    bl_idname = "qc3d.split_key"
    bl_label = "Split Key Left and Right"
    bl_options = {'REGISTER', 'UNDO'}

    if TYPE_CHECKING:
        key: str
        falloff: float
    else:
        key: StringProperty(
            name="Key", description="The key to split; by default the active one", options={'SKIP_SAVE'}
        )
        falloff: FloatProperty(
            name="Falloff",
            description="Distance from the middle, along x, over which one side fades into the other",
            default=0.1,
            min=0.0,
            subtype='DISTANCE',
            unit='LENGTH',
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        try:
            obj = checks.require_object(context.active_object)
            active = obj.active_shape_key
            name = self.key or (active.name if active is not None else "")
            *notes, done = self._split(obj, name)
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        for note in notes:
            self.report({'WARNING'}, note)
        self.report({'INFO'}, done)
        return {'FINISHED'}

    def _split(self, obj: bpy.types.Object, name: str) -> list[str]:
        """Split a key, or only its in-betweens if it has keys for its sides; the last sentence says what was done."""
        keys = keys_of(obj)
        checks.require_keys(keys, [name])
        record = Record.read(keys)
        chain = record.chain_on_key(name)
        if chain is None:
            made = split_key(obj, name, self.falloff)
            return [f"'{name}' was split into '{made[0]}' and '{made[1]}'."]
        end_previews()
        chain_keys.all_owned_keys(keys, chain)  # refused before anything is changed
        sides = sides_of(obj, name)
        both = sides or split_key(obj, name, self.falloff)
        notes = split_in_betweens(obj, record, chain, both)
        what = "The in-betweens of " if sides else ""
        how = "" if sides else ", with its in-betweens"
        return [*notes, f"{what}'{name}' {'were' if sides else 'was'} split into '{both[0]}' and '{both[1]}'{how}."]
