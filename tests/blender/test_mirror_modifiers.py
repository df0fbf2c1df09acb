# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that are one half with a Mirror modifier: the seam stays shut wherever the slider is."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from qc3d_addon.blender.bake.seams import opened_seams
from qc3d_addon.blender.store.mesh_data import read_pairs
from qc3d_addon.blender.store.mirror_modifiers import mirror_planes
from qc3d_addon.solver.errors import InputError

from .conftest import add_key

Shown = Callable[..., np.ndarray]
SLIDER = "Basis→Sway"
PLACES = np.linspace(0.0, 1.0, 21)

pytestmark = pytest.mark.usefixtures("work_here")


def half(axes: str = "X", turn: np.ndarray | None = None, seam: float = 0.0) -> bpy.types.Object:
    """A block of quads cut along planes; "Sway" bends it within the planes."""
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    obj = bpy.context.active_object
    obj.name = "Half"
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.subdivide(number_cuts=5)
    bpy.ops.object.mode_set(mode='OBJECT')
    mesh = obj.data
    points = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3).round(6)
    faces = [list(polygon.vertices) for polygon in mesh.polygons]
    cut = ["XYZ".index(axis) for axis in axes]
    faces = [face for face in faces if all(points[face][:, axis].min() > -1e-4 for axis in cut)]
    used, corners = np.unique(np.concatenate(faces), return_inverse=True)
    points = points[used]
    sway = points.copy()
    along = max(axis for axis in range(3) if axis not in cut)
    for axis in range(3):
        if axis not in cut and axis != along:
            sway[:, axis] += 0.8 * points[:, along] ** 2
    sway[:, along] *= 1.1
    for axis in cut:
        sway[:, axis] *= 1.0 + 0.5 * (points[:, along] > 0.2)
        on_plane = np.abs(points[:, axis]) < 1e-5
        points[on_plane, axis], sway[on_plane, axis] = seam, -seam
    if turn is not None:
        points, sway = points @ turn[:3, :3].T + turn[:3, 3], sway @ turn[:3, :3].T + turn[:3, 3]
    other = bpy.data.meshes.new("Half")
    other.from_pydata(points.tolist(), [], corners.reshape(-1, 4).tolist())
    obj.data = other
    add_key(obj, "Basis", lambda rest: rest)
    add_key(obj, "Sway", lambda rest: sway)
    return obj


def mirrored(obj: bpy.types.Object, axes: str = "X", **choices: object) -> bpy.types.MirrorModifier:
    modifier = obj.modifiers.new("Mirror", 'MIRROR')
    modifier.use_axis = [axis in axes for axis in "XYZ"]
    for name, value in choices.items():
        setattr(modifier, name, value)
    bpy.context.view_layer.update()
    return modifier


def bake(count: int = 3) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Sway", count=count) == {'FINISHED'}


@pytest.mark.parametrize("clip", [False, True])
@pytest.mark.parametrize("axes", ["X", "Y", "Z", "XY"])
def test_the_seam_stays_shut(shown: Shown, axes: str, clip: bool) -> None:
    obj = half(axes)
    mirrored(obj, axes, use_clip=clip)
    whole = len(shown(obj))
    assert whole < 2 ** len(axes) * len(obj.data.vertices)
    bake()
    assert "mirror image" in " ".join(_notes(obj))
    for place in PLACES:
        points = shown(obj, **{SLIDER: place})
        assert len(points) == whole
        own = points[: len(obj.data.vertices)]
        for axis in ("XYZ".index(axis) for axis in axes):
            on_plane = np.abs(np.array([vertex.co[axis] for vertex in obj.data.vertices])) == 0.0
            assert on_plane.any()
            assert not own[on_plane, axis].any()


def test_across_another_object(shown: Shown) -> None:
    empty = bpy.data.objects.new("Plane", None)
    bpy.context.collection.objects.link(empty)
    empty.rotation_euler, empty.location, empty.scale = (0.3, -0.7, 1.1), (0.4, -0.2, 0.7), (1.0, 1.5, 1.0)
    bpy.context.view_layer.update()
    # Seen from an object that is stretched, the mirror is sheared.
    own = Matrix.LocRotScale((3.0, 1.0, 0.0), None, (1.0, 2.0, 0.5))
    obj = half("X", np.array(own.inverted() @ empty.matrix_world))
    obj.matrix_world = own
    mirrored(obj, "X", mirror_object=empty)
    rest = shown(obj)
    # Where Blender shows the images is where the whole has them.
    pair = read_pairs(obj, ("Basis", "Sway"))["Basis", "Sway"]
    images = pair.key0[len(obj.data.vertices) :]
    distance = np.linalg.norm(rest[:, None] - images[None], axis=2).min(axis=0)
    assert distance.max() < 1e-3
    assert len(rest) < 2 * len(obj.data.vertices)
    bake()
    assert {len(shown(obj, **{SLIDER: value})) for value in PLACES} == {len(rest)}


def test_vertices_near_the_plane_stay_as_near(shown: Shown) -> None:
    obj = half("X", seam=4e-4)
    mirrored(obj)
    whole = len(shown(obj))
    assert whole < 2 * len(obj.data.vertices)
    bake()
    assert {len(shown(obj, **{SLIDER: place})) for place in PLACES} == {whole}


def test_a_key_that_opens_the_seam_is_named(shown: Shown) -> None:
    obj = half("X")
    mirrored(obj)
    assert not opened_seams(read_pairs(obj, ("Basis", "Sway")))
    points = obj.data.shape_keys.key_blocks["Sway"].points
    seam = [number for number, vertex in enumerate(obj.data.vertices) if vertex.co.x == 0.0]
    for number in seam[:3]:
        points[number].co.x += 0.1
    bake()
    [said] = [note for note in _notes(obj) if "opens" in note]
    assert said.startswith("3 vertices of the seam are on the mirror plane in 'Basis' but not in 'Sway', where")


def test_what_mirrors_nothing_is_left_out() -> None:
    obj = half("X")
    whole = [np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])]
    modifier = mirrored(obj, use_bisect_axis=[True, False, False])
    assert not mirror_planes(obj, whole)  # cut in two by the modifier
    modifier.use_bisect_axis = [False] * 3
    assert len(mirror_planes(obj, whole)) == 1
    modifier.show_viewport = False
    assert len(mirror_planes(obj, whole)) == 1  # in renders
    modifier.show_render = False
    assert not mirror_planes(obj, whole)


@pytest.mark.parametrize("choices", [{"use_bisect_axis": (True, False, False)}, {"show_viewport": False}])
def test_a_half_that_is_also_cut_or_shown_in_renders_only(shown: Shown, choices: dict[str, object]) -> None:
    """Where the whole mesh is on one side, nothing is cut off; and seams in renders stay shut too."""
    obj = half("X")
    modifier = mirrored(obj, **choices)
    bake()
    modifier.show_viewport = True
    assert len({len(shown(obj, **{SLIDER: place})) for place in PLACES}) == 1


def test_a_mirror_object_without_size_is_refused() -> None:
    obj = half("X")
    empty = bpy.data.objects.new("Flat", None)
    bpy.context.collection.objects.link(empty)
    empty.scale = (0.0, 1.0, 1.0)
    mirrored(obj, mirror_object=empty)
    with pytest.raises(InputError, match=r"'Flat' has the scale 0"):
        mirror_planes(obj, [])


def test_quads_are_read_as_faces() -> None:
    obj = half("X")
    pair = read_pairs(obj, ("Basis", "Sway"))["Basis", "Sway"]
    assert len(np.unique(pair.polygons)) == len(obj.data.polygons) == len(pair.faces) // 2


def _notes(obj: bpy.types.Object) -> list[str]:
    from qc3d_addon.blender.store.records import Record

    chain = Record.read(obj.data.shape_keys).chains[-1]
    assert chain.result is not None
    return list(chain.result.notes)
