# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's mesh data as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from ..kinds import keys_of, mesh_of
from . import checks
from .mirror_modifiers import mirror_planes

if TYPE_CHECKING:
    from ...solver.keys.keypair import Ends, KeyPair


def read_pairs(obj: bpy.types.Object, names: Sequence[str], base: str = "") -> dict[Ends, KeyPair]:
    """The pairs of consecutive shape keys in ``names``, checked, by the names of their keys.

    A key with a vertex group is read as it appears when its value is 1, except ``base``, which is read as it is
    stored. If Mirror modifiers complete the mesh, the pairs are those of the whole.

    Raises
    ------
    InputError
        If a name is not a shape key of the mesh, or coordinates cannot be used.
    """
    from ...solver.keys.keypair import consecutive_pairs

    checks.require_keys(keys_of(obj), names)
    coordinates = {name: key_coordinates(obj, name) if name == base else shown_coordinates(obj, name) for name in names}
    mesh = mesh_of(obj)
    planes = mirror_planes(obj, list(coordinates.values()))
    return consecutive_pairs(coordinates, triangles(mesh), wire_edges(mesh), names, polygons(mesh), planes)


def key_coordinates(obj: bpy.types.Object, name: str) -> NDArray[np.float32]:
    """(n, 3) float32 absolute positions that a shape key of the object's mesh stores.

    Raises
    ------
    InputError
        If the number of points of the key differs from the number of vertices.
    """
    mesh = mesh_of(obj)
    points = keys_of(obj).key_blocks[name].points
    if len(points) != len(mesh.vertices):
        raise InputError(
            f"Shape key '{name}' has {len(points)} points but the mesh has {len(mesh.vertices)} vertices; "
            "enter and leave Edit Mode once to repair the key."
        )
    coordinates = np.empty(3 * len(points), dtype=np.float32)
    points.foreach_get("co", coordinates)
    return coordinates.reshape(-1, 3)


def shown_coordinates(obj: bpy.types.Object, name: str) -> NDArray[np.float32]:
    """(n, 3) float32 positions of a shape key as it appears when its value is 1: limited by its vertex group.

    Raises
    ------
    InputError
        If the number of points of the key differs from the number of vertices.
    """
    keys = keys_of(obj)
    group = keys.key_blocks[name].vertex_group
    coordinates = key_coordinates(obj, name)
    if not group or group not in obj.vertex_groups:
        return coordinates
    # Let Blender itself mix the key, on a copy that is in no scene.
    copy = obj.copy()
    mesh = copy.data = mesh_of(obj).copy()
    try:
        copy.show_only_shape_key = False
        for key in keys_of(copy).key_blocks:
            key.mute = key.name != name
        mixed_key = keys_of(copy).key_blocks[name]
        mixed_key.slider_min, mixed_key.slider_max, mixed_key.value = 0.0, 1.0, 1.0
        mixed = key_coordinates(copy, copy.shape_key_add(name="mixed", from_mix=True).name)
    finally:
        bpy.data.objects.remove(copy)
        bpy.data.meshes.remove(mesh)
    return key_coordinates(obj, keys.key_blocks[name].relative_key.name) + (
        mixed - key_coordinates(obj, keys.reference_key.name)
    )


def set_key_coordinates(key: bpy.types.ShapeKey, coordinates: NDArray[np.float32]) -> None:
    """Replace the positions of a shape key by an (n, 3) float32 array, bit for bit."""
    key.points.foreach_set("co", np.ascontiguousarray(coordinates, dtype=np.float32).ravel())


def triangles(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """(m, 3) vertex indices of the mesh's faces, as Blender triangulates them."""
    mesh.calc_loop_triangles()
    corners = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    return corners.reshape(-1, 3)


def polygons(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """(m,) index of the face that each of the ``triangles`` belongs to."""
    mesh.calc_loop_triangles()
    owners = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("polygon_index", owners)
    return owners


def wire_edges(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """(e, 2) vertex indices of the edges that belong to no face."""
    ends = np.empty(2 * len(mesh.edges), dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    edge_of_corner = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("edge_index", edge_of_corner)
    is_wire = np.ones(len(mesh.edges), dtype=bool)
    is_wire[edge_of_corner] = False
    wires: NDArray[np.int32] = ends.reshape(-1, 2)[is_wire]
    return wires


def arrays_of(mesh: bpy.types.Mesh) -> dict[str, NDArray[np.int32]]:
    """What a file of keys needs of a mesh: its ``faces``, their ``polygons``, and the ``edges`` of no face."""
    return {"faces": triangles(mesh), "edges": wire_edges(mesh), "polygons": polygons(mesh)}
