# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colliders, the objects that in-betweens must not enter, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from ..kinds import mesh_of, shape_keys_of
from ..store.evaluation import evaluated
from ..store.mesh_data import key_coordinates, triangles

if TYPE_CHECKING:
    from ...solver.collision.colliders import Collider


def read_colliders(obj: bpy.types.Object, name: str, through: Sequence[str]) -> Collider | None:
    """The meshes of a collection, seen from ``obj``, at each of the keys ``through``; None where the name is empty.

    A mesh that has shape keys of all these names moves along with them; any other stays as it is shown now, modifiers
    included.

    Raises
    ------
    InputError
        If there is no such collection, or it has no mesh with faces besides ``obj`` itself.
    """
    from ...solver.collision.colliders import Collider

    if not name:
        return None
    collection = bpy.data.collections.get(name)
    if collection is None:
        raise InputError(f"There is no collection '{name}'; choose the collection with the colliders.")
    meshes = [other for other in collection.all_objects if other.type == 'MESH' and other != obj]
    parts = []
    with evaluated([obj, *meshes]) as depsgraph:
        from_world = obj.evaluated_get(depsgraph).matrix_world.inverted_safe()
        for other in meshes:
            shown = other.evaluated_get(depsgraph)
            points, faces = _shapes(other, shown, through)
            if not len(faces):
                continue
            to_object = np.array(from_world @ shown.matrix_world)
            if np.linalg.det(to_object[:3, :3]) < 0.0:
                faces = faces[:, ::-1]  # a mirrored object is turned inside out
            parts.append(Collider.checked(points @ to_object[:3, :3].T + to_object[:3, 3], faces))
    if not parts:
        raise InputError(f"The collection '{name}' has no other meshes with faces; put the colliders into it.")
    return Collider.joined(parts)


def changed_since(obj: bpy.types.Object, name: str, through: Sequence[str], planned: Collider | None) -> list[str]:
    """A sentence if the collection's meshes, as seen from ``obj``, have changed since a bake was planned."""
    try:
        found = read_colliders(obj, name, through)
    except InputError:
        found = None
    if planned is None or (found is not None and _same(found, planned)):
        return []
    return [f"The colliders in '{name}' were changed during the bake; re-bake to use their present places."]


def _same(one: Collider, other: Collider) -> bool:
    return np.array_equal(one.shapes, other.shapes) and np.array_equal(one.faces, other.faces)


def _shapes(
    other: bpy.types.Object, shown: bpy.types.Object, through: Sequence[str]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Positions (k, c, 3) of a mesh at each key, in its own coordinates, and its triangles (f, 3).

    ``shown`` is the evaluated object.
    """
    keys = shape_keys_of(other)
    if keys is not None and set(through) <= set(keys.key_blocks.keys()):
        shapes = {name: key_coordinates(other, name).astype(np.float64) for name in dict.fromkeys(through)}
        return np.stack([shapes[name] for name in through]), triangles(mesh_of(other))
    mesh = shown.to_mesh()
    try:
        points = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        mesh.vertices.foreach_get("co", points)
        faces = triangles(mesh)
    finally:
        shown.to_mesh_clear()
    return np.broadcast_to(points.reshape(-1, 3).astype(np.float64), (len(through), len(points) // 3, 3)), faces
