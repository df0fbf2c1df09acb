# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators for combinations of keys."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from collections.abc import Iterator
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, StringProperty

from ...solver.errors import InputError, QC3DError
from .. import compat
from ..combinations import combine, correction_keys, verdicts
from ..kinds import keys_of, present
from ..store import checks, combined_keys
from .child_work import ChildWork
from .common import OperatorMixin, Status, end_previews, poll_active_object, report_error

if TYPE_CHECKING:
    from ...solver.combinations.corrections import Corrected



class CombinationWork(OperatorMixin):
    """Works on combinations of keys step by step; an operator defines ``work``."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def work(self, context: bpy.types.Context) -> Iterator[object]:
        """Yield the fraction that is done and, last, a sentence for the user; raises QC3DError if it fails."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> Status:
        end_previews()
        manager = present(context.window_manager)
        manager.progress_begin(0.0, 1.0)
        said = ""
        try:
            with compat.interruptible():
                for step in self.work(context):
                    if isinstance(step, float):
                        manager.progress_update(step)
                    else:
                        said = str(step)
        except KeyboardInterrupt:
            report_error(self, f"{self.bl_label} was interrupted; nothing was changed.")
            return {'CANCELLED'}
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        finally:
            manager.progress_end()
        self.report({'INFO'}, said)
        return {'FINISHED'}


class QC3D_OT_combine_keys(ChildWork[combine.CombinationPlan, "Corrected"], bpy.types.Operator):
    """Add keys that correct two or three keys while they are on at once; these keys themselves stay as they are"""

    bl_idname = "qc3d.combine_keys"
    bl_label = "Combine Keys"

    if TYPE_CHECKING:
        first: str
        second: str
        third: str
        find_order: bool
    else:
        first: StringProperty(name="Key", description="One of the keys", options={'SKIP_SAVE'})
        second: StringProperty(name="And", description="Another one", options={'SKIP_SAVE'})
        third: StringProperty(name="And", description="Optional third key", options={'SKIP_SAVE'})
        find_order: BoolProperty(
            name="Find the Outer Key",
            description="Find out which key carries the others along; otherwise each key carries the following ones",
            default=True,
            options={'SKIP_SAVE'},
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        self._asks = not (self.first and self.second) and not bpy.app.background
        if not self._asks:
            return super().invoke(context, event)
        return set(present(context.window_manager).invoke_props_dialog(self))

    def execute(self, context: bpy.types.Context) -> Status:
        if getattr(self, "_asks", False):  # the dialog was confirmed
            return self._guarded(context, lambda: self._begin(context, self.plan(context)))
        return super().execute(context)

    def draw(self, context: bpy.types.Context) -> None:
        layout, keys = present(self.layout), keys_of(present(context.active_object))
        for name in ("first", "second", "third"):
            layout.prop_search(self, name, keys, "key_blocks", icon='SHAPEKEY_DATA')
        layout.prop(self, "find_order")

    def plan(self, context: bpy.types.Context) -> combine.CombinationPlan:
        end_previews()
        chosen = [name for name in (self.first, self.second, self.third) if name]
        return combine.plan_combination(context.active_object, chosen, self.find_order)

    def write(self, plan: combine.CombinationPlan, outcome: "Corrected") -> list[str]:
        end_previews()
        return [combine.write_combination(plan, outcome).text]


class QC3D_OT_judge_pairs(CombinationWork, bpy.types.Operator):
    """Find out which pairs of this object's keys simply add up, and which need a combination"""

    bl_idname = "qc3d.judge_pairs"
    bl_label = "Judge All Pairs"
    bl_options = {'REGISTER'}  # nothing in the file changes

    def work(self, context: bpy.types.Context) -> Iterator[object]:
        yield from verdicts.judge(context.active_object)
        found = verdicts.found(checks.require_object(context.active_object))
        needing = sum(not one.adding_is_right for one in found)
        yield f"{needing} of {len(found)} pairs need a combination; adding is right for the others."


class QC3D_OT_remove_combination(CombinationWork, bpy.types.Operator):
    """Remove the correction keys of this combination; the combined keys themselves stay as they are"""

    bl_idname = "qc3d.remove_combination"
    bl_label = "Remove Combination"
    bl_options = {'REGISTER', 'UNDO'}

    if TYPE_CHECKING:
        label: str
    else:
        label: StringProperty(
            name="Keys", description="Names of the keys, joined by +, as in the panel", options={'SKIP_SAVE'}
        )

    def work(self, context: bpy.types.Context) -> Iterator[object]:
        obj = checks.require_object(context.active_object)
        chosen = next((one for one in combined_keys.read(keys_of(obj)) if one.label == self.label), None)
        if chosen is None:
            raise InputError(f"There is no combination '{self.label}'; choose one from the panel.")
        for note in correction_keys.remove(obj, chosen):
            self.report({'WARNING'}, note)
        yield f"The combination of {chosen.label} was removed."
