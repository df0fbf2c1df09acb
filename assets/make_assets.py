# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the demo files from Blender's own primitives, the same every time: python assets/make_assets.py [FOLDER].

``limb.blend`` is a mannequin's arm on a chest that stays still; ``suzanne.blend`` is Suzanne with expressions;
``lid.blend`` is a lid that closes over an eyeball, which is in the collection "Eyeball". The shipped files were saved
by Blender 4.5, so that 4.5 and everything after it opens them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Deformation = Callable[[Floats], Floats]


def main(folder: Path) -> None:
    """Write the files into ``folder``."""
    for name, build in (("limb", build_limb), ("suzanne", build_suzanne), ("lid", build_lid)):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        build()
        path = folder / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        print(f"{path}: {path.stat().st_size / 1024:.0f} KiB")


def build_limb() -> None:
    """An arm along the x axis, in meters: chest, upper arm, forearm, and a hand with a thumb, as one closed surface."""
    pieces = [
        _ball((-0.42, 0.0, -0.02), (0.48, 0.36, 0.62)),
        _ball((0.0, 0.0, 0.25), (0.4, 0.36, 0.38)),
        _ball((1.3, 0.0, 0.25), (0.27, 0.25, 0.25)),
        _ball((2.3, 0.0, 0.25), (0.18, 0.16, 0.18)),
        _ball((2.66, 0.0, 0.27), (0.4, 0.13, 0.27)),
        _tapered((0.0, 0.0, 0.25), (1.3, 0.0, 0.25), 0.34, 0.25),
        _tapered((1.3, 0.0, 0.25), (2.3, 0.0, 0.25), 0.27, 0.17),
        _tapered((2.4, 0.0, 0.3), (2.62, 0.0, 0.68), 0.12, 0.09),
        _ball((2.62, 0.0, 0.68), (0.1, 0.09, 0.1)),
    ]
    arm = _joined(pieces, "Arm")
    remesh = arm.modifiers.new("Remesh", "REMESH")
    remesh.mode = "VOXEL"
    remesh.voxel_size = 0.05
    smooth = arm.modifiers.new("Smooth", "SMOOTH")
    smooth.factor = 0.5
    smooth.iterations = 8
    _apply_modifiers(arm)

    axis = np.array([0.0, 0.0, 0.25])
    bend = np.radians(90.0)
    twist = np.radians(120.0)
    _add_shapes(
        arm,
        {
            "Bend 90": lambda points: _swept(points, axis, bend, 0.0),
            "Twist 120": lambda points: _swept(points, axis, 0.0, twist),
            "Bend and twist": lambda points: _swept(points, axis, bend, twist),
        },
    )


def build_suzanne() -> None:
    """Suzanne, subdivided once: a jaw that drops, ears that turn back, brows that rise, and all of it together."""
    bpy.ops.mesh.primitive_monkey_add()
    suzanne = bpy.context.object
    suzanne.name = suzanne.data.name = "Suzanne"
    subdivision = suzanne.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = 1
    _apply_modifiers(suzanne)

    def jaw(points: Floats) -> Floats:
        below = _rise(-points[:, 2], 0.34, 0.62) * _rise(-points[:, 1], 0.1, 0.5)
        return _turned(points, (0.0, -0.1, -0.3), (1.0, 0.0, 0.0), np.radians(28.0) * below)

    def ears(points: Floats) -> Floats:
        for side in (-1.0, 1.0):
            outside = _rise(side * points[:, 0], 0.75, 1.05)
            points = _turned(points, (side * 0.8, 0.1, 0.2), (0.0, 0.0, 1.0), side * np.radians(50.0) * outside)
        return points

    def brows(points: Floats) -> Floats:
        front = _rise(-points[:, 1], 0.25, 0.55) * _rise(points[:, 2], 0.42, 0.7)
        return _turned(points, (0.0, 0.1, 0.3), (1.0, 0.0, 0.0), -np.radians(14.0) * front)

    _add_shapes(
        suzanne,
        {
            "Jaw drop": jaw,
            "Ears back": ears,
            "Surprise": lambda points: brows(ears(jaw(points))),
        },
    )


def build_lid() -> None:
    """An eyeball of radius 1 with a strong cornea toward -y, and an upper lid 2 % of the radius above it."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=1.0)
    eyeball = bpy.context.object
    eyeball.name = eyeball.data.name = "Eyeball"
    rays = np.empty(3 * len(eyeball.data.vertices), dtype=np.float32)
    eyeball.data.vertices.foreach_get("co", rays)
    eyeball.data.vertices.foreach_set("co", _bulging(rays.reshape(-1, 3).astype(np.float64)).astype(np.float32).ravel())
    eyeball.data.polygons.foreach_set("use_smooth", [True] * len(eyeball.data.polygons))
    collection = bpy.data.collections.new("Eyeball")
    bpy.context.scene.collection.children.link(collection)
    for other in eyeball.users_collection:
        other.objects.unlink(eyeball)
    collection.objects.link(eyeball)

    rows, columns = 24, 41
    numbers = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]], axis=-1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Lid")
    mesh.from_pydata(_lid(38.0, rows, columns).tolist(), [], quads.tolist())
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    lid = bpy.data.objects.new("Lid", mesh)
    bpy.context.scene.collection.objects.link(lid)
    bpy.context.view_layer.objects.active = lid
    _add_shapes(lid, {"Closed": lambda points: _lid(-15.0, rows, columns)})


def _lid(margin: float, rows: int, columns: int) -> Floats:
    """A lid from its crease, 70 degrees above the middle, to its margin; both run together at the corners."""
    down, across = np.linspace(0.0, 1.0, rows)[:, None], np.linspace(-1.0, 1.0, columns)[None]
    latitude = np.radians((70.0 + (margin - 70.0) * down) * (1.0 - across**2))
    longitude = np.radians(62.0) * (across + 0.0 * down)
    flat = np.cos(latitude)
    rays = np.stack([flat * np.sin(longitude), -flat * np.cos(longitude), np.sin(latitude)], axis=-1).reshape(-1, 3)
    return _bulging(rays) + 0.02 * rays


def _bulging(rays: Floats) -> Floats:
    """Points of the eyeball on rays of length 1: a ball, a quarter longer in the middle of the cornea."""
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip(-rays[:, 1], -1.0, 1.0)))
    return np.asarray(rays * (1.0 + 0.25 * np.maximum(1.0 - (angle / 30.0) ** 2, 0.0) ** 2)[:, None])


def _ball(centre: tuple[float, float, float], radii: tuple[float, float, float]) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, location=centre, scale=radii)
    return bpy.context.object


def _tapered(
    start: tuple[float, float, float], end: tuple[float, float, float], radius1: float, radius2: float
) -> bpy.types.Object:
    """A truncated cone between two points."""
    from mathutils import Vector

    along = Vector(end) - Vector(start)
    bpy.ops.mesh.primitive_cone_add(
        vertices=32,
        radius1=radius1,
        radius2=radius2,
        depth=along.length,
        location=(Vector(start) + Vector(end)) / 2.0,
        rotation=along.to_track_quat("Z", "Y").to_euler(),
    )
    return bpy.context.object


def _joined(pieces: list[bpy.types.Object], name: str) -> bpy.types.Object:
    bpy.ops.object.select_all(action="DESELECT")
    for piece in pieces:
        piece.select_set(True)
    bpy.context.view_layer.objects.active = pieces[0]
    bpy.ops.object.join()
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    joined = bpy.context.object
    joined.name = joined.data.name = name
    return joined


def _apply_modifiers(obj: bpy.types.Object) -> None:
    for name in [modifier.name for modifier in obj.modifiers]:
        bpy.ops.object.modifier_apply(modifier=name)
    obj.data.polygons.foreach_set("use_smooth", [True] * len(obj.data.polygons))


def _add_shapes(obj: bpy.types.Object, shapes: dict[str, Deformation]) -> None:
    """Give the object a Basis and one shape key, of value 0, for each deformation of it."""
    obj.shape_key_add(name="Basis", from_mix=False)
    basis = np.empty(3 * len(obj.data.vertices), dtype=np.float32)
    obj.data.vertices.foreach_get("co", basis)
    points = basis.reshape(-1, 3).astype(np.float64)
    for name, deform in shapes.items():
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0
        key.points.foreach_set("co", deform(points).astype(np.float32).ravel())
    still = np.ptp([deform(points) for deform in shapes.values()] + [points], axis=0).max(axis=1) == 0.0
    print(f"{obj.name}: {len(points)} vertices, {still.mean():.0%} of them still in every key")


def _swept(points: Floats, origin: Floats, bend: float, twist: float) -> Floats:
    """Bend an arm along x upwards at its elbow and twist it about itself, without thinning or folding it.

    Each cross-section moves rigidly along the bent axis; sections before the elbow's region only twist, and what lies
    before the twist's region, the chest and the shoulder, does not move at all.
    """
    stations = np.linspace(0.0, 4.0, 4001)
    angles = bend * _rise(stations, 0.85, 1.85)
    steps = 0.5 * np.diff(stations) * np.stack([np.cos(angles[1:]) + np.cos(angles[:-1]),
                                                np.sin(angles[1:]) + np.sin(angles[:-1])])  # fmt: skip
    along, up = np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1)

    moved = points.copy()
    arm = points[:, 0] > 0.45
    x, y, z = (points[arm] - origin).T
    turn = twist * _rise(x, 0.45, 2.35)
    y, z = np.cos(turn) * y - np.sin(turn) * z, np.sin(turn) * y + np.cos(turn) * z
    angle = bend * _rise(x, 0.85, 1.85)
    axis_x, axis_z = np.interp(x, stations, along), np.interp(x, stations, up)
    moved[arm] = origin + np.stack([axis_x - np.sin(angle) * z, y, axis_z + np.cos(angle) * z], axis=1)
    return moved


def _turned(
    points: Floats, pivot: tuple[float, float, float], axis: tuple[float, float, float], angles: Floats
) -> Floats:
    """Turn each point about the same line by an angle of its own; those of angle 0 stay exactly where they are."""
    turned = points.copy()
    moving = angles != 0.0
    offset, direction = points[moving] - np.array(pivot), np.array(axis)
    cosine, sine = np.cos(angles[moving, None]), np.sin(angles[moving, None])
    turned[moving] = (
        np.array(pivot)
        + cosine * offset
        + sine * np.cross(direction, offset)
        + (1.0 - cosine) * (offset @ direction)[:, None] * direction
    )
    return turned


def _rise(values: Floats, start: float, end: float) -> Floats:
    """From 0 below ``start`` to 1 above ``end``, with two continuous derivatives."""
    t = np.clip((values - start) / (end - start), 0.0, 1.0)
    return np.asarray(t**3 * (10.0 - 15.0 * t + 6.0 * t**2))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
