# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials, lights and camera of the demo figure, and how the 3D views of its file show it."""

from __future__ import annotations

import bpy
import figure_head
from mathutils import Vector

# Linear red, green, blue; roughness.
MATERIALS = {
    "Skin": (figure_head.SKIN, 0.5),
    "Lips": (figure_head.LIP, 0.5),
    "Mouth": (figure_head.MOUTH, 0.5),
    "Skin plain": (figure_head.SKIN, 0.5),
    "Lid": ((0.70, 0.32, 0.20), 0.5),
    "Lash": ((0.05, 0.015, 0.03), 0.5),
    "Hair": ((0.07, 0.022, 0.10), 0.45),
    "Tongue": ((0.62, 0.12, 0.13), 0.35),
    "Eye": ((0.9, 0.9, 0.88), 0.12),
    "Iris": ((0.03, 0.25, 0.24), 0.12),
    "Pupil": ((0.005, 0.005, 0.006), 0.1),
    "Sweater": ((0.02, 0.19, 0.21), 0.85),
    "Cuff": ((0.80, 0.33, 0.04), 0.85),
    "Wood": ((0.30, 0.15, 0.07), 0.5),
}
_PAINTED = ("Skin", "Lips", "Mouth")  # by the attribute Paint, where materials are drawn; solid views show their colors
_LIGHTS = {"Key": ((-2.2, -3.2, 3.6), 1.6, 190.0), "Fill": ((3.2, -2.4, 1.6), 2.2, 50.0),
           "Rim": ((1.6, 2.6, 3.2), 1.4, 240.0)}  # fmt: skip
_TARGET = Vector((0.26, 0.0, 1.16))


def material(name: str) -> bpy.types.Material:
    """One of ``MATERIALS``, made when it is first asked for."""
    if name in bpy.data.materials:
        return bpy.data.materials[name]
    made = bpy.data.materials.new(name)
    color, roughness = MATERIALS[name]
    made.diffuse_color, made.roughness = (*color, 1.0), roughness
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    shader.inputs["Roughness"].default_value = roughness
    if name in (*_PAINTED, "Skin plain", "Lid", "Tongue"):
        shader.inputs["Subsurface Weight"].default_value = 0.15
        shader.inputs["Subsurface Radius"].default_value = (0.06, 0.02, 0.01)
    if name in _PAINTED:
        paint = made.node_tree.nodes.new("ShaderNodeVertexColor")
        paint.layer_name = "Paint"
        made.node_tree.links.new(paint.outputs["Color"], shader.inputs["Base Color"])
    return made


def add_studio() -> None:
    """Three lights, the camera, a plain background, and the views looking through the camera."""
    scene = bpy.context.scene
    for name, (place, size, power) in _LIGHTS.items():
        light = bpy.data.lights.new(name, "AREA")
        light.shape, light.size, light.energy = "DISK", size, power
        _place(name, light, place).hide_viewport = True
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 64.0
    scene.camera = _place("Camera", camera, (0.5, -5.4, 1.5))
    scene.render.resolution_x, scene.render.resolution_y = 1280, 1080
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.62, 0.68, 0.72, 1.0)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.55
    scene.world = world
    scene.view_settings.view_transform = "Standard"
    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == "VIEW_3D":
                space = area.spaces.active
                space.region_3d.view_perspective = "CAMERA"
                for shown in ("relationship_lines", "floor", "axis_x", "axis_y", "cursor", "object_origins"):
                    setattr(space.overlay, f"show_{shown}", False)


def _place(name: str, data: object, place: tuple[float, float, float]) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    obj.location = place
    obj.rotation_euler = (_TARGET - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    return obj
