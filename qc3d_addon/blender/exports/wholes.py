# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Halves as the whole that their Mirror modifiers show, while they are exported.

Blender's exporters leave these modifiers out where there are shape keys.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.arrays import Bools, Floats, Ints
from ...solver.errors import InputError
from .. import compat
from ..chains.absolute_copy import copied
from ..keys import drivers
from ..keys.control import Control, value_path
from ..kinds import expect, keys_of, mesh_of, present
from ..store.evaluation import evaluated
from ..store.mesh_data import key_coordinates, set_key_coordinates
from ..store.mirror_modifiers import mirror_planes, mirrored_axes

if TYPE_CHECKING:
    from ...solver.keys.halves import MirrorPlane

_SOURCE = "qc3d_source"  # attribute of the vertices while modifiers are evaluated
_SAME = 1e-4  # relative to the size: where the modifiers put a vertex, and where its image is


@dataclass(frozen=True, eq=False)
class Whole:
    """How the vertices of a whole come from those of its half.

    Parameters
    ----------
    sources : (N,)
        The vertex of the half.
    planes : tuple of MirrorPlane
    is_image, is_merged : (N, p)
        Whether a vertex is mirrored across a plane, or lies on it, merged with its own image.
    """

    sources: Ints
    planes: tuple[MirrorPlane, ...]
    is_image: Bools
    is_merged: Bools

    def shape(self, points: Floats) -> Floats:
        """A shape (n, 3) of the half, completed (N, 3)."""
        found = points[self.sources]
        for number, plane in enumerate(self.planes):
            found = plane.raised(found, self._shares(number) * plane.heights(found))
        return found

    def offsets(self, offsets: Floats) -> Floats:
        """Offsets (k, n, 3) of the half's vertices, completed (k, N, 3)."""
        found = offsets[:, self.sources]
        for number, plane in enumerate(self.planes):
            along = self._shares(number) * (found @ np.array(plane.normal))
            found = found + along[..., None] * np.array(plane.direction)
        return found

    def _shares(self, number: int) -> Floats:
        return np.where(self.is_merged[:, number], -1.0, np.where(self.is_image[:, number], -2.0, 0.0))


@contextmanager
def as_whole(obj: bpy.types.Object) -> Iterator[Whole | None]:
    """Give a half the mesh of its whole, with keys that follow its own; None, and no change, without Mirror modifiers.

    Everything is as it was after the block.

    Raises
    ------
    InputError
        If a Mirror modifier cuts the mesh, so that its vertices are others at other values of the keys.
    """
    modifiers = list(dict.fromkeys(modifier for modifier, _, _ in mirrored_axes(obj)))
    if not modifiers:
        yield None
        return
    own, keys = mesh_of(obj), keys_of(obj)
    with ExitStack() as undo:
        undo.callback(setattr, own, "name", own.name)
        mesh, whole = _completed(obj, undo)
        own.name, mesh.name = f"{own.name} half", own.name
        for modifier in modifiers:
            for shown in ("show_viewport", "show_render"):
                undo.callback(setattr, modifier, shown, getattr(modifier, shown))
                setattr(modifier, shown, False)
        undo.callback(setattr, obj, "active_shape_key_index", obj.active_shape_key_index)
        undo.callback(setattr, obj, "data", own)
        shapes = {key.name: whole.shape(key_coordinates(obj, key.name).astype(np.float64)) for key in keys.key_blocks}
        obj.data = mesh
        _add_keys(obj, keys, shapes)
        yield whole


def _completed(obj: bpy.types.Object, undo: ExitStack) -> tuple[bpy.types.Mesh, Whole]:
    """The mesh that the Mirror modifiers alone make of the Basis; closing ``undo`` removes it."""
    rest = key_coordinates(obj, keys_of(obj).reference_key.name)
    planes = mirror_planes(obj, [rest])
    if len(planes) < len(list(mirrored_axes(obj))):
        raise InputError(
            f"A Mirror modifier of '{obj.name}' cuts its mesh by Bisect, which shapes of other programs cannot; turn "
            "it off, or export Alembic."
        )
    with ExitStack() as after:
        copy = copied(obj, after)
        compat.clear_shape_keys(copy)
        copy.animation_data_clear()
        mesh = mesh_of(copy)
        mesh.vertices.foreach_set("co", rest.ravel())
        sources = np.arange(len(rest), dtype=np.int32)
        expect(bpy.types.IntAttribute, mesh.attributes.new(_SOURCE, 'INT', 'POINT')).data.foreach_set("value", sources)
        for modifier in list(copy.modifiers):
            if isinstance(modifier, bpy.types.MirrorModifier):
                modifier.show_viewport = modifier.show_viewport or modifier.show_render
            else:
                copy.modifiers.remove(modifier)
        with evaluated([copy]) as depsgraph:
            shown = copy.evaluated_get(depsgraph)
            made = bpy.data.meshes.new_from_object(shown, preserve_all_data_layers=True, depsgraph=depsgraph)
    undo.callback(bpy.data.meshes.remove, made)
    points = np.empty(3 * len(made.vertices), dtype=np.float32)
    made.vertices.foreach_get("co", points)
    sources = np.empty(len(made.vertices), dtype=np.int32)
    attribute = expect(bpy.types.IntAttribute, made.attributes[_SOURCE])
    attribute.data.foreach_get("value", sources)
    made.attributes.remove(attribute)
    whole = _matched(rest.astype(np.float64), points.reshape(-1, 3).astype(np.float64), sources, planes)
    return made, whole


def _matched(rest: Floats, points: Floats, sources: NDArray[np.int32], planes: tuple[MirrorPlane, ...]) -> Whole:
    """Find out across which planes each vertex of a whole was mirrored."""
    count = len(planes)
    best = np.full(len(points), np.inf)
    image = np.zeros((len(points), count), dtype=bool)
    merged = np.stack([np.abs(plane.heights(rest[sources])) <= plane.reach for plane in planes], axis=1)
    for choice in range(2**count):
        chosen = np.broadcast_to([bool(choice >> number & 1) for number in range(count)], image.shape)
        tried = Whole(sources.astype(np.int64), planes, chosen, merged)
        distances = np.linalg.norm(tried.shape(rest) - points, axis=1)
        nearer = distances < best
        best[nearer], image[nearer] = distances[nearer], chosen[nearer]
    if best.max(initial=0.0) > _SAME * max(float(np.ptp(points, axis=0).max(initial=0.0)), 1e-30):
        raise InputError("The Mirror modifiers move vertices that they merge too far; lower their merge distance.")
    return Whole(sources.astype(np.int64), planes, image, merged)


def _add_keys(obj: bpy.types.Object, keys: bpy.types.Key, shapes: dict[str, Floats]) -> None:
    """Add keys of these shapes whose values follow those of ``keys``."""
    for key in keys.key_blocks:
        made = obj.shape_key_add(name=key.name, from_mix=False)
        set_key_coordinates(made, shapes[key.name].astype(np.float32))
        made.slider_min, made.slider_max, made.value = key.slider_min, key.slider_max, key.value
        made.mute, made.vertex_group = key.mute, key.vertex_group
    following = keys_of(obj)
    for key in keys.key_blocks:
        following.key_blocks[key.name].relative_key = following.key_blocks[key.relative_key.name]
        if key != keys.reference_key:
            curve = compat.new_driver(following, value_path(key.name))
            drivers.read(present(curve.driver), Control(keys, key.name))
