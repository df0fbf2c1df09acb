# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that work on baked in-betweens."""

# Blender reads properties from evaluated annotations: no "from __future__ import annotations" here.

from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ...solver.errors import InputError, QC3DError
from ..chains import absolute_copy, alembic, keyframes, mirror, remove, to_key
from ..kinds import keys_of, present
from ..store import checks
from ..store.chain import Chain
from ..store.records import Record
from .common import SLIDER, OperatorMixin, Status, chosen_chain, end_previews, poll_chains, report_error

_MOST_FRAMES = 100_000


class ChainWork(OperatorMixin):
    """Works on the chosen chain at once, without a child process; an operator defines ``work``."""

    bl_options = {'REGISTER', 'UNDO'}

    if TYPE_CHECKING:  # the operators' own: Blender 4.2 crashes where a class inherits both properties and methods
        slider: str

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        """Do the work; returns sentences for the user, the last of which says what was done.

        Raises QC3DError if it is impossible; nothing is changed then.
        """
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> Status:
        end_previews()
        try:
            obj = checks.require_object(context.active_object)
            slider = chosen_chain(obj, self.slider).slider
            record = Record.read(keys_of(obj))
            chain = present(record.chain_of_slider(slider))
            *notes, done = self.work(context, obj, record, chain)
        except QC3DError as error:
            report_error(self, str(error))
            return {'CANCELLED'}
        for note in notes:
            self.report({'WARNING'}, note)
        self.report({'INFO'}, done)
        return {'FINISHED'}


class QC3D_OT_remove(ChainWork, bpy.types.Operator):
    """Remove these in-betweens with their shape keys, drivers, slider, and the keyframes that the bake made"""

    bl_idname = "qc3d.remove"
    bl_label = "Remove"

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        notes = remove.remove_chain(obj, record, chain)
        return [*notes, f"The in-betweens of '{chain.slider}' were removed."]


class QC3D_OT_play_on_key(ChainWork, bpy.types.Operator):
    """Play these in-betweens by the last key's own value instead of their slider"""

    bl_idname = "qc3d.play_on_key"
    bl_label = "Play on the Key"

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        moved, notes = to_key.play_on_key(obj, record, chain)
        return [*notes, f"The value of '{moved.on_key}' plays the in-betweens."]


class QC3D_OT_to_keyframes(ChainWork, bpy.types.Operator):
    """Replace slider and drivers by keyframes of the shape keys over a range of frames"""

    bl_idname = "qc3d.to_keyframes"
    bl_label = "Bake to Keyframes"

    if TYPE_CHECKING:
        slider: SLIDER
        frame_start: int
        frame_end: int
    else:
        slider: SLIDER
        frame_start: IntProperty(
            name="Start", description="First frame; by default that of the scene", options={'SKIP_SAVE'}
        )
        frame_end: IntProperty(
            name="End", description="Last frame; by default that of the scene", options={'SKIP_SAVE'}
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        for name in ("frame_start", "frame_end"):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(context.scene, name))
        frames = range(self.frame_start, self.frame_end + 1)
        if not 2 <= len(frames) <= _MOST_FRAMES:
            first, last = self.frame_start, self.frame_end
            raise InputError(f"Frames {first} to {last} are not possible; choose 2 to {_MOST_FRAMES} frames.")
        notes = keyframes.bake_to_keyframes(context, obj, record, chain, frames)
        return [*notes, f"The shape keys of '{chain.slider}' have keyframes from {frames[0]} to {frames[-1]}."]


class QC3D_OT_absolute_keys(ChainWork, bpy.types.Operator):
    """Copy the object and give the copy these in-betweens as absolute shape keys, played by the evaluation time"""

    bl_idname = "qc3d.absolute_keys"
    bl_label = "Copy with Absolute Keys"

    slider: SLIDER

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        copy = absolute_copy.copy_with_absolute_keys(obj, chain)
        return [f"'{copy.name}' has {chain.intervals + 1} absolute keys; the slider of '{obj.name}' plays them."]


class QC3D_OT_mirror(ChainWork, bpy.types.Operator):
    """Make the mirror image of these in-betweens for the other side of a symmetric mesh, with its own slider or key"""

    bl_idname = "qc3d.mirror"
    bl_label = "Mirror"

    if TYPE_CHECKING:
        slider: SLIDER
        use_topology: bool
    else:
        slider: SLIDER
        use_topology: BoolProperty(
            name="Topology",
            description="Find the mirror images of vertices also by how the mesh is built, where places do not tell",
            default=False,
            options={'SKIP_SAVE'},
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        mirrored, notes = mirror.mirror_chain(obj, record, chain, self.use_topology)
        return [*notes, f"The slider '{mirrored.slider}' plays the mirror image of '{chain.slider}'."]


class QC3D_OT_export_alembic(ChainWork, bpy.types.Operator):
    """Write these in-betweens as an Alembic file in which the slider goes from 0 to 1"""

    bl_idname = "qc3d.export_alembic"
    bl_label = "Export Alembic"
    bl_options = {'REGISTER'}  # nothing in the file changes

    if TYPE_CHECKING:
        slider: SLIDER
        filepath: str
        check_existing: bool
        filter_glob: str
        frames: int
    else:
        slider: SLIDER
        filepath: StringProperty(name="File", subtype='FILE_PATH', options={'SKIP_SAVE'})
        check_existing: BoolProperty(default=True, options={'HIDDEN', 'SKIP_SAVE'})
        filter_glob: StringProperty(default="*.abc", options={'HIDDEN', 'SKIP_SAVE'})
        frames: IntProperty(
            name="Frames", description="Frames from the first key to the last", default=25, min=2, max=_MOST_FRAMES
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return poll_chains(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Status:
        self.filepath = f"{bpy.path.clean_name(present(context.active_object).name)}.abc"
        present(context.window_manager).fileselect_add(self)
        return {'RUNNING_MODAL'}

    def work(self, context: bpy.types.Context, obj: bpy.types.Object, record: Record, chain: Chain) -> list[str]:
        if not self.filepath:
            raise InputError("Name a file to write.")
        path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), ".abc"))
        alembic.export_alembic(context, obj, chain, path, self.frames)
        return [f"{path.name} has '{obj.name}' in {self.frames} frames."]
