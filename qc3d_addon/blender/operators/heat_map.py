# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that show where in-betweens are distorted."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.props import EnumProperty

from ...solver.errors import InputError, QC3DError
from ..heat_map import heat_map, legend
from ..heat_map.colors import MEASURE_ITEMS
from ..keys.chain_keys import control_of, owned_keys
from ..kinds import keys_of, mesh_of, present
from ..store import checks
from ..store.chain import Chain
from ..store.summaries import WorstPlace
from .common import SLIDER, Status, chosen_chain, poll_chains


class QC3D_OT_heat_map(bpy.types.Operator):
    """Color the mesh by how much the in-betweens stretch it, or hide the colors again"""

    bl_idname = "qc3d.heat_map"
    bl_label = "Heat Map"
    bl_options = {"UNDO"}

    if TYPE_CHECKING:
        slider: SLIDER
        measure: str
        show: str
    else:
        slider: SLIDER
        measure: EnumProperty(
            name="Measure",
            description="What the colors show",
            items=MEASURE_ITEMS,
            default="stretch",
            options={"SKIP_SAVE"},
        )
        show: EnumProperty(
            name="Show",
            description="Whether to show the heat map",
            items=[
                ("toggle", "Toggle", "Hide it if it is shown, otherwise show it"),
                ("on", "On", "Show it"),
                ("off", "Off", "Hide it"),
            ],
            default="toggle",
            options={"SKIP_SAVE"},
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        try:
            obj = checks.require_object(context.active_object)
            chain = chosen_chain(obj, self.slider)
            state = heat_map.shown(obj)
            is_same = state is not None and (state.slider, state.measure) == (chain.slider, self.measure)
            if self.show == "off" or (self.show == "toggle" and is_same):
                heat_map.hide(obj)
                legend.leave(context)
            else:
                heat_map.show(obj, chain, self.measure)
                legend.enter(context)
        except QC3DError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class QC3D_OT_select_worst(bpy.types.Operator):
    """Move slider, 3D cursor and selection to where the in-betweens stretch or shrink most beyond their keys"""

    bl_idname = "qc3d.select_worst"
    bl_label = "Select Worst Place"
    bl_options = {"UNDO"}

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def execute(self, context: bpy.types.Context) -> Status:
        try:
            obj = checks.require_object(context.active_object)
            chain = chosen_chain(obj, self.slider)
            worst = _worst_place(obj, chain)
        except QC3DError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        mesh, keys = mesh_of(obj), keys_of(obj)
        stays = control_of(obj, chain).put(worst.at)
        if stays is not None:
            self.report({"WARNING"}, stays)
        # Make the nearest in-between the active key, so that Edit and Sculpt Mode show and change it.
        steps = owned_keys(keys, chain)
        if steps:
            nearest = min(steps, key=lambda step: abs(chain.places[step] - worst.at))
            obj.active_shape_key_index = keys.key_blocks.find(steps[nearest].name)
        _select(mesh, worst.vertex)
        evaluated = obj.evaluated_get(context.evaluated_depsgraph_get())
        cursor = present(context.scene).cursor
        if len(mesh_of(evaluated).vertices) == len(mesh.vertices):  # no modifier adds vertices
            cursor.location = evaluated.matrix_world @ mesh_of(evaluated).vertices[worst.vertex].co
        if isinstance(context.space_data, bpy.types.SpaceView3D):
            present(context.space_data.region_3d).view_location = cursor.location
        self.report({"INFO"}, f"Vertex {worst.vertex} at {worst.at:.2f}: {worst.excess:.1%} beyond the keys.")
        return {"FINISHED"}


def _worst_place(obj: bpy.types.Object, chain: Chain) -> WorstPlace:
    """The worst place of a chain; raises InputError if it is unknown or the slider cannot be set."""
    worst = None if chain.result is None else chain.result.worst
    if worst is None or worst.vertex >= len(mesh_of(obj).vertices):
        raise InputError(f"The in-betweens of '{chain.slider}' were not measured on this mesh; re-bake them.")
    control_of(obj, chain).require()
    return worst


def _select(mesh: bpy.types.Mesh, vertex: int) -> None:
    """Select a vertex and the edges and faces around it."""
    ends = np.empty(2 * len(mesh.edges), dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    around = np.unique(ends.reshape(-1, 2)[(ends.reshape(-1, 2) == vertex).any(axis=1)])
    chosen = np.zeros(len(mesh.vertices), dtype=bool)
    chosen[vertex] = chosen[around] = True
    mesh.vertices.foreach_set("select", chosen)
    mesh.edges.foreach_set("select", chosen[ends.reshape(-1, 2)].all(axis=1))
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    if len(starts):
        mesh.polygons.foreach_set("select", np.logical_and.reduceat(chosen[corners], starts))
    mesh.update()
