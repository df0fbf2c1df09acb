# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the demo files, the same every time: python assets/make_assets.py [FOLDER].

``figure.blend``, which ships inside the add-on, is a bust whose rig drives the keys of its face, lids and arm;
``limb.blend`` is an arm with a hand; ``suzanne.blend`` is Suzanne with expressions; ``lid.blend`` is a lid that closes
over an eyeball, which is in the collection "Eyeball". The shipped files were saved by Blender 4.5, so that 4.5 and
everything after it opens them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import figure_body
import numpy as np
from clay import Floats
from figure import add_mesh, build_figure
from motions import rise, swept, turned

Deformation = Callable[[Floats], Floats]
HERE = Path(__file__).parent


def main(folder: Path | None) -> None:
    """Write the files into ``folder``, or where they are shipped."""
    for name, (build, shipped) in FILES.items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        build()
        path = (folder or shipped) / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        print(f"{path}: {path.stat().st_size / 1024:.0f} KiB")


def build_limb() -> None:
    """The figure's arm alone, 3.5 times as large, along x: shoulder, elbow, and a hand with fingers."""
    points, faces = figure_body.arm(0.0226)
    size, middle = 3.5, np.array([0.4, 0.0, 0.0])

    def placed(shape: Floats) -> Floats:
        return np.asarray((shape - middle) * size + [1.0, 0.0, 0.25])

    origin, bend, twist = (0.0, 0.0, 0.0), np.radians(90.0), np.radians(120.0)
    bends, twists = figure_body.ELBOW, (0.18, 0.95)
    keys = {
        "Bend 90": placed(swept(points, origin, bend, bends)),
        "Twist 120": placed(swept(points, origin, 0.0, bends, twist, twists)),
        "Bend and twist": placed(swept(points, origin, bend, bends, twist, twists)),
    }
    bpy.context.view_layer.objects.active = add_mesh("Arm", placed(points), faces, ("Skin plain",), keys=keys)


def build_suzanne() -> None:
    """Suzanne, subdivided once: a jaw that drops, ears that turn back, brows that rise, and all of it together."""
    bpy.ops.mesh.primitive_monkey_add()
    suzanne = bpy.context.object
    suzanne.name = suzanne.data.name = "Suzanne"
    subdivision = suzanne.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = 1
    _apply_modifiers(suzanne)

    def jaw(points: Floats) -> Floats:
        below = rise(-points[:, 2], 0.34, 0.62) * rise(-points[:, 1], 0.1, 0.5)
        return turned(points, (0.0, -0.1, -0.3), (1.0, 0.0, 0.0), np.radians(28.0) * below)

    def ears(points: Floats) -> Floats:
        for side in (-1.0, 1.0):
            outside = rise(side * points[:, 0], 0.75, 1.05)
            points = turned(points, (side * 0.8, 0.1, 0.2), (0.0, 0.0, 1.0), side * np.radians(50.0) * outside)
        return points

    def brows(points: Floats) -> Floats:
        front = rise(-points[:, 1], 0.25, 0.55) * rise(points[:, 2], 0.42, 0.7)
        return turned(points, (0.0, 0.1, 0.3), (1.0, 0.0, 0.0), -np.radians(14.0) * front)

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


FILES: dict[str, tuple[Callable[[], None], Path]] = {
    "limb": (build_limb, HERE),
    "suzanne": (build_suzanne, HERE),
    "lid": (build_lid, HERE),
    "figure": (build_figure, HERE.parent / "qc3d_addon" / "demo"),
}

if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
