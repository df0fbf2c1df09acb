# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo figure's rig: a board of bones beside it, each of which drives shape keys when it is pulled up."""

from __future__ import annotations

import bpy
import numpy as np

REACH = 0.2  # meters by which a bone is pulled up to bring its key fully on
_BOARD = {"Brows": (-1.05, 1.75), "Blink.R": (-1.2, 1.4), "Blink.L": (-0.9, 1.4), "Jaw": (-1.05, 1.05),
          "Bend": (-1.2, 0.7), "Fist": (-0.9, 0.7)}  # fmt: skip
# For each bone: frames, and how far it is pulled up then.
_MOTION = {
    "Blink.L": ((8, 0.0), (18, 1.0), (22, 1.0), (32, 0.0), (72, 0.0), (76, 1.0), (78, 1.0), (82, 0.0)),
    "Blink.R": ((8, 0.0), (18, 1.0), (22, 1.0), (32, 0.0), (72, 0.0), (76, 1.0), (78, 1.0), (82, 0.0)),
    "Bend": ((26, 0.0), (50, 1.0), (70, 1.0), (94, 0.0)),
    "Brows": ((38, 0.0), (48, 1.0), (62, 1.0), (72, 0.0)),
    "Jaw": ((38, 0.0), (48, 1.0), (62, 1.0), (72, 0.0)),
    "Fist": ((1, 0.0), (12, 1.0), (24, 0.0)),
}
LAST = 96


def add_rig(eyes: list[bpy.types.Object]) -> bpy.types.Object:
    """The armature; the eyes look at its bone Look."""
    data = bpy.data.armatures.new("Rig")
    data.show_names = True
    rig = bpy.data.objects.new("Rig", data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for name, (x, z) in _BOARD.items():
        _bone(data, name, (x, -0.3, z))
    _bone(data, "Look", (0.0, -2.0, 1.62))
    tongue = _bone(data, "Tongue", (0.0, 0.02, 1.4))
    tongue.tail = (0.0, -0.1, 1.4)
    bpy.ops.object.mode_set(mode="OBJECT")
    shape = _diamond()
    for bone in rig.pose.bones:
        if bone.name in _BOARD:
            bone.custom_shape = shape
            bone.lock_location, bone.lock_rotation, bone.lock_scale = (True, False, True), (True,) * 3, (True,) * 3
            limit = bone.constraints.new("LIMIT_LOCATION")
            limit.owner_space, limit.use_transform_limit = "LOCAL", True
            limit.use_min_y = limit.use_max_y = True
            limit.min_y, limit.max_y = 0.0, REACH
    for eye in eyes:
        look = eye.constraints.new("DAMPED_TRACK")
        look.target, look.subtarget, look.track_axis = rig, "Look", "TRACK_NEGATIVE_Y"
    return rig


def drive(obj: bpy.types.Object, rig: bpy.types.Object) -> None:
    """Let each key of the object follow the bone of the same name."""
    for key in obj.data.shape_keys.key_blocks[1:]:
        _follow(key.driver_add("value").driver, rig, key.name, f"pulled / {REACH}")


def carry_tongue(rig: bpy.types.Object, angle: float) -> None:
    """Let the bone Tongue turn by an angle, in radians, as the jaw opens."""
    bone = rig.pose.bones["Tongue"]
    bone.rotation_mode = "XYZ"
    rig.data.bones["Tongue"].hide = True  # nothing to be pulled by hand
    _follow(bone.driver_add("rotation_euler", 0).driver, rig, "Jaw", f"{angle:.4f} * pulled / {REACH}")


def _follow(driver: bpy.types.Driver, rig: bpy.types.Object, bone: str, expression: str) -> None:
    variable = driver.variables.new()
    variable.name, variable.type = "pulled", "TRANSFORMS"
    target = variable.targets[0]
    target.id, target.bone_target = rig, bone
    target.transform_type, target.transform_space = "LOC_Y", "LOCAL_SPACE"
    driver.type, driver.expression = "SCRIPTED", expression


def animate(rig: bpy.types.Object) -> None:
    """A short loop with every control."""
    for name, moments in _MOTION.items():
        bone = rig.pose.bones[name]
        for frame, amount in moments:
            bone.location[1] = REACH * amount
            bone.keyframe_insert("location", index=1, frame=frame)
    scene = bpy.context.scene
    scene.render.fps = 24
    scene.frame_start, scene.frame_end = 1, LAST
    scene.frame_set(1)


def _bone(data: bpy.types.Armature, name: str, head: tuple[float, float, float]) -> bpy.types.EditBone:
    bone = data.edit_bones.new(name)
    bone.head, bone.tail = head, (head[0], head[1], head[2] + 0.08)
    bone.use_deform = False
    return bone


def _diamond() -> bpy.types.Object:
    """What the bones of the board look like."""
    mesh = bpy.data.meshes.new("Control")
    turns = np.linspace(0.0, 2.0 * np.pi, 5)[:-1]
    mesh.from_pydata([(0.7 * np.sin(turn), 0.7 * np.cos(turn), 0.0) for turn in turns],
                     [(0, 1), (1, 2), (2, 3), (3, 0)], [])  # fmt: skip
    return bpy.data.objects.new("Control", mesh)
