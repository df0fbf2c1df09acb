# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo figure in Blender: a bust whose rig drives shape keys of its face, lids, brows and arm."""

from __future__ import annotations

import bpy
import figure_body
import figure_head
import numpy as np
from clay import Floats, Ints
from figure_rig import add_rig, animate, carry_tongue, drive
from figure_studio import MATERIALS, add_studio, material

HEAD = np.array([0.0, 0.0, 1.5])
Shapes = dict[str, Floats]


def build_figure() -> None:
    """The whole scene. The face has the keys Jaw and Brows, the brows Brows, the lids Blink.L and Blink.R, the arm Bend
    and Fist; the collection "Eyes" holds what the lids must not enter."""
    for name in MATERIALS:
        material(name)
    meshes = [_face(), _lids(), _brows(), _arm(), *_still()]
    eyes = _eyes()
    rig = add_rig(eyes)
    for obj in meshes + eyes:
        obj.parent = rig
    tongue = bpy.data.objects["Tongue"]
    tongue.parent_type, tongue.parent_bone = "BONE", "Tongue"
    tongue.matrix_parent_inverse = (rig.matrix_world @ _tail(rig, "Tongue")).inverted()
    for obj in meshes:
        if obj.data.shape_keys is not None:
            drive(obj, rig)
    carry_tongue(rig, -figure_head.JAW)
    animate(rig)
    add_studio()
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = bpy.data.objects["Arm"]
    bpy.data.objects["Arm"].select_set(True)


def add_mesh(name: str, points: Floats, faces: Ints, materials: tuple[str, ...], choice: Ints | None = None,
             keys: Shapes | None = None) -> bpy.types.Object:  # fmt: skip
    """A smooth mesh (n, 3) with polygons (m, c), of which ``choice`` names the materials, and its shape keys."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(_snapped(points).tolist(), [], faces.tolist())
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    for used in materials:
        mesh.materials.append(material(used))
    if choice is not None:
        mesh.polygons.foreach_set("material_index", choice.astype(np.int32))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    if keys:
        obj.shape_key_add(name="Basis", from_mix=False)
    for key_name, shape in (keys or {}).items():
        key = obj.shape_key_add(name=key_name, from_mix=False)
        key.value = 0.0
        key.points.foreach_set("co", _snapped(shape).astype(np.float32).ravel())
    obj.active_shape_key_index = 1 if keys else 0  # the panel takes it for the key to bake
    return obj


def _snapped(points: Floats) -> Floats:
    """Points on a grid of a 16th of a millimeter: files compress better, and nothing shows."""
    return np.round(points * 2.0**14) / 2.0**14


def _face() -> bpy.types.Object:
    points, faces = figure_head.head()
    paint = figure_head.colors(points)
    keys = {"Jaw": figure_head.jaw(points), "Brows": figure_head.forehead_up(points)}
    shades = np.array([figure_head.SKIN, figure_head.LIP, figure_head.MOUTH])
    nearest = np.linalg.norm(paint[faces].mean(axis=1)[:, None] - shades, axis=2).argmin(axis=1)
    moved = {name: key + HEAD for name, key in keys.items()}
    face = add_mesh("Face", points + HEAD, faces, ("Skin", "Lips", "Mouth"), nearest, moved)
    attribute = face.data.color_attributes.new("Paint", "BYTE_COLOR", "POINT")
    attribute.data.foreach_set("color", np.c_[paint, np.ones(len(paint))].astype(np.float32).ravel())
    return face


def _lids() -> bpy.types.Object:
    points, faces, margins = figure_head.lids(0.0, 0.0)
    choice = (margins[faces].min(axis=1) > 0.0).astype(int)
    keys = {"Blink.L": figure_head.lids(1.0, 0.0)[0] + HEAD, "Blink.R": figure_head.lids(0.0, 1.0)[0] + HEAD}
    return add_mesh("Lids", points + HEAD, faces, ("Lid", "Lash"), choice, keys)


def _brows() -> bpy.types.Object:
    points, faces = figure_head.brow()
    both = np.concatenate([points, points * figure_head.MIRROR])
    keys = {"Brows": figure_head.forehead_up(both) + HEAD}
    return add_mesh("Brows", both + HEAD, np.concatenate([faces, faces[:, ::-1] + len(points)]), ("Hair",), keys=keys)


def _arm() -> bpy.types.Object:
    points, faces = figure_body.arm()
    along = points[faces, 0].mean(axis=1)
    choice = np.searchsorted(figure_body.CUFF, along)
    keys = {"Bend": figure_body.bent(points), "Fist": figure_body.fist(points)}
    placed = {name: figure_body.placed(key) for name, key in keys.items()}
    return add_mesh("Arm", figure_body.placed(points), faces, ("Sweater", "Cuff", "Skin plain"), choice, placed)


def _still() -> list[bpy.types.Object]:
    """What has no keys: hair, tongue, torso and plinth."""
    hair, tongue = figure_head.hair(), figure_head.tongue()
    torso, collar = figure_body.torso(), figure_body.collar()
    bpy.ops.mesh.primitive_cylinder_add(vertices=64, radius=0.74, depth=0.1, location=(-0.03, 0.03, -0.05))
    plinth = bpy.context.object
    plinth.name = plinth.data.name = "Plinth"
    plinth.data.materials.append(material("Wood"))
    bevel = plinth.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.02, 3
    return [add_mesh("Hair", hair[0] + HEAD, hair[1], ("Hair",)),
            add_mesh("Tongue", tongue[0] + HEAD, tongue[1], ("Tongue",)),
            add_mesh("Torso", *torso, ("Sweater",)), add_mesh("Collar", *collar, ("Cuff",)), plinth]  # fmt: skip


def _eyes() -> list[bpy.types.Object]:
    collection = bpy.data.collections.new("Eyes")
    bpy.context.scene.collection.children.link(collection)
    eyes = []
    for name, side in (("Eye.L", 1.0), ("Eye.R", -1.0)):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=40, ring_count=30, radius=figure_head.EYE_RADIUS,
                                             rotation=(np.pi / 2.0, 0.0, 0.0))  # fmt: skip
        bpy.ops.object.transform_apply(location=False, rotation=True, scale=True)
        eye = bpy.context.object
        eye.name = eye.data.name = name
        eye.location = figure_head.EYE * [side, 1.0, 1.0] + HEAD
        for used in ("Eye", "Iris", "Pupil"):
            eye.data.materials.append(material(used))
        toward = np.array([-face.center[1] / figure_head.EYE_RADIUS for face in eye.data.polygons])
        eye.data.polygons.foreach_set("material_index", np.searchsorted((0.86, 0.955), toward).astype(np.int32))
        eye.data.polygons.foreach_set("use_smooth", [True] * len(toward))
        for other in eye.users_collection:
            other.objects.unlink(eye)
        collection.objects.link(eye)
        eyes.append(eye)
    return eyes


def _tail(rig: bpy.types.Object, name: str) -> object:
    """Where Blender hangs what is parented to a bone: its tail."""
    from mathutils import Matrix

    bone = rig.data.bones[name]
    return bone.matrix_local @ Matrix.Translation((0.0, bone.length, 0.0))
