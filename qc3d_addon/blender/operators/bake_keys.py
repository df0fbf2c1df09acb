# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that bakes many keys of an object in one run, each played by its own value."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty

from ...solver.errors import CanceledError, QC3DError
from ..bake.jobs import Job
from ..bake.many import ManyPlan, bakeable_keys, plan_keys, summary
from ..choices import BakeChoices, InnerKey
from ..kinds import keys_of, present
from ..preferences import limits
from ..properties import bake_request, fill_from_panel, settings_of, show_newest
from ..store import checks
from .child_work import ChildWork
from .common import Status, end_previews, poll_active_object

if TYPE_CHECKING:
    from ...solver.frames.task import Outcome


# Of the dialog with ticks; the width of a column is in pixels, before the interface's scale.
_ROWS, _MOST_COLUMNS, _WIDTH = 16, 5, 220


class KeyChoice(bpy.types.PropertyGroup):
    """A key with a tick, by its name."""

    if TYPE_CHECKING:
        use: bool
    else:
        use: BoolProperty(name="Bake", description="Bake in-betweens on this key", default=True)


class QC3D_OT_bake_keys(BakeChoices, ChildWork[ManyPlan, "Sequence[Outcome | QC3DError]"], bpy.types.Operator):
    """Bake in-betweens for many shape keys at once, each played by its own value; keys that need none are skipped"""

    bl_idname = "qc3d.bake_keys"
    bl_label = "Bake Keys"

    if TYPE_CHECKING:
        which: str
        # Shadows bpy_struct.keys, the names of custom properties, of which an operator has none.
        keys: "bpy.types.bpy_prop_collection_idprop[InnerKey]"  # type: ignore[assignment]
        ticks: "bpy.types.bpy_prop_collection_idprop[KeyChoice]"
    else:
        which: EnumProperty(
            name="Keys",
            description="The keys to bake",
            items=[
                ("all", "All", "All keys except the Basis and baked in-betweens"),
                ("selected", "Selected", "Keys selected in the list; before Blender 5, keys that you tick in a dialog"),
                ("named", "Named", "Keys of the list \"keys\""),
            ],
            default="all",
            options={'SKIP_SAVE'},
        )
        keys: CollectionProperty(
            name="Keys", description="Keys to bake, as [{\"name\": key}, ...]", type=InnerKey, options={'SKIP_SAVE'}
        )
        ticks: CollectionProperty(
            name="Ticks", description="Keys of the dialog", type=KeyChoice, options={'SKIP_SAVE', 'HIDDEN'}
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_active_object(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        self._asks = self.which == "selected" and not _can_select() and not bpy.app.background
        if not self._asks:
            return super().invoke(context, event)
        self.ticks.clear()
        for name in bakeable_keys(context.active_object):
            self.ticks.add().name = name
        return set(present(context.window_manager).invoke_props_dialog(self, width=_WIDTH * self._columns()))

    def draw(self, context: bpy.types.Context) -> None:
        grid = present(self.layout).grid_flow(columns=self._columns(), even_columns=True)
        for key in self.ticks:
            grid.prop(key, "use", text=key.name)

    def execute(self, context: bpy.types.Context) -> Status:
        if getattr(self, "_asks", False):  # the list was confirmed
            return self._guarded(context, lambda: self._begin(context, self.plan(context)))
        return super().execute(context)

    def plan(self, context: bpy.types.Context) -> ManyPlan:
        obj = checks.require_object(context.active_object)
        fill_from_panel(self.properties, settings_of(obj))
        return plan_keys(obj, self._chosen(obj), bake_request(self, ("", "")), limits(context).memory_mb)

    def write(self, plan: ManyPlan, outcome: "Sequence[Outcome | QC3DError]") -> list[str]:
        end_previews()
        verdicts = plan.write(outcome)
        show_newest(plan.locate())
        return [*map(str, verdicts), summary(verdicts)]

    def write_done(self, plan: ManyPlan, job: Job) -> list[str]:
        outcomes = job.outcomes(CanceledError("was not reached before the bake was canceled"))
        if all(isinstance(outcome, CanceledError) for outcome in outcomes):
            return []
        return self.write(plan, outcomes)

    def _columns(self) -> int:
        """Columns of the dialog: the keys of a face do not fit on a screen one below the other."""
        return min(-(-len(self.ticks) // _ROWS), _MOST_COLUMNS)

    def _chosen(self, obj: bpy.types.Object) -> list[str]:
        if self.which == "named" or (self.which == "selected" and len(self.keys)):
            return [key.name for key in self.keys]
        if getattr(self, "_asks", False):
            return [key.name for key in self.ticks if key.use]
        known = bakeable_keys(obj)
        if self.which == "all":
            return known
        return [name for name in known if getattr(keys_of(obj).key_blocks[name], "select", False)]


def _can_select() -> bool:
    """Whether this Blender knows which shape keys are selected."""
    return "select" in bpy.types.ShapeKey.bl_rna.properties
