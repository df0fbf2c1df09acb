# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens in other programs' files: read back by readers that are not Blender's, they move as in Blender."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.exports import usd_files
from qc3d_addon.blender.exports.export import export
from qc3d_addon.solver.errors import InputError

pytestmark = pytest.mark.usefixtures("quick_map")

FIRST, LAST = 1, 13
# How far 13 straight parts of the path in the tests may leave the smooth one, over the size; and single precision.
STRAIGHT_PARTS, ROUNDING = 5e-4, 2e-6

Shown = Callable[..., np.ndarray]


@pytest.fixture
def played(figure: bpy.types.Object) -> bpy.types.Object:
    """The figure, moved, with in-betweens on its key Lean, which a custom property drives and keyframes move."""
    return animated(figure)


def animated(figure: bpy.types.Object) -> bpy.types.Object:
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = FIRST, LAST
    figure.location, figure.rotation_euler = (1.0, 2.0, 3.0), (0.3, 0.2, 0.1)
    figure.data.shape_keys.key_blocks["Stretch"].value = 0.25
    figure["smile"] = 0.0
    curve = figure.data.shape_keys.driver_add('key_blocks["Lean"].value')
    variable = curve.driver.variables.new()
    variable.name, variable.targets[0].id, variable.targets[0].data_path = "v", figure, '["smile"]'
    curve.driver.expression = "v"
    for frame, value in ((FIRST, 0.0), (LAST, 1.0)):
        figure["smile"] = value
        figure.keyframe_insert('["smile"]', frame=frame)
    keys = {"from_key": "Basis", "to_key": "Lean", "mode": "linear", "easing": "ease-in-out"}
    assert bpy.ops.qc3d.bake_inbetweens(**keys, count=3) == {"FINISHED"}
    return figure


def halve(figure: bpy.types.Object) -> None:
    """Cut off what is behind y = 0, and let a Mirror modifier show it."""
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.bisect(plane_co=(0.0, 0.0, 0.0), plane_no=(0.0, 1.0, 0.0), clear_inner=True)
    bpy.ops.object.mode_set(mode="OBJECT")
    for key in figure.data.shape_keys.key_blocks:
        values = np.empty(3 * len(key.points), dtype=np.float32)
        key.points.foreach_get("co", values)
        at = values.reshape(-1, 3)
        rest = figure.data.shape_keys.reference_key
        base = np.empty_like(values)
        rest.points.foreach_get("co", base)
        at[np.abs(base.reshape(-1, 3)[:, 1]) < 1e-5, 1] = 0.0
        key.points.foreach_set("co", values)
    mirror = figure.modifiers.new("Mirror", 'MIRROR')
    mirror.use_axis = (False, True, False)


def motion(obj: bpy.types.Object, shown: Shown) -> np.ndarray:
    """(frames, n, 3) what Blender shows, in the object's own space."""
    shapes = []
    for frame in range(FIRST, LAST + 1):
        bpy.context.scene.frame_set(frame)
        shown(obj)  # a second evaluation: see export._settled_values
        shapes.append(shown(obj))
    return np.array(shapes, dtype=float)


def largest_distance(frames: np.ndarray, truth: np.ndarray, what: str) -> float:
    """Over the size; printed, since it is what the documentation says."""
    size = float(np.linalg.norm(np.ptp(truth[0], axis=0)))
    found = float(np.linalg.norm(frames - truth, axis=2).max()) / size
    print(f"{what}, Blender {bpy.app.version_string}: largest distance over time {found:.2g} of the size")
    return found


READ_USD = """
import sys
import numpy as np
from pxr import Usd, UsdGeom, UsdSkel
stage = Usd.Stage.Open(sys.argv[1])
[mesh] = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
cache = UsdSkel.Cache()
root = UsdSkel.Root.Find(mesh)
cache.Populate(root, Usd.PrimDefaultPredicate)
[binding] = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
skinning = binding.GetSkinningTargets()[0]
animation = cache.GetSkelQuery(binding.GetSkeleton()).GetAnimQuery()
shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(mesh))
frames = []
for frame in range(int(sys.argv[2]), int(sys.argv[3]) + 1):
    weights = animation.ComputeBlendShapeWeights(frame)
    mapper = skinning.GetBlendShapeMapper()
    weights = mapper.Remap(weights) if mapper else weights
    computed = shapes.ComputeSubShapeWeights(weights)
    points = np.array(UsdGeom.Mesh(mesh).GetPointsAttr().Get())
    from pxr import Vt
    moved = Vt.Vec3fArray.FromNumpy(points)
    assert shapes.ComputeDeformedPoints(*computed, shapes.ComputeBlendShapePointIndices(),
                                        shapes.ComputeSubShapePointOffsets(), moved)
    frames.append(np.array(moved))
np.save(sys.argv[4], frames)
print(" ".join(UsdSkel.BindingAPI(mesh).GetBlendShapesAttr().Get()))
"""


def read_usd(path: Path) -> tuple[list[str], np.ndarray]:
    """Names of the shapes, and the motion.

    By usd-core, in a process of its own: Blender's USD and this one do not know of each other.
    """
    frames = path.with_suffix(".npy")
    command = [sys.executable, "-c", READ_USD, str(path), str(FIRST), str(LAST), str(frames)]
    names = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert names.returncode == 0, names.stderr
    return names.stdout.split(), np.load(frames)


@pytest.mark.parametrize("ending", [".usda", ".usdc"])
def test_usd(ending: str, played: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
    truth = motion(played, shown)
    path = tmp_path / f"figure{ending}"
    assert export(played, path) == []
    names, found = read_usd(path)
    assert names == ["Lean", "Stretch"]
    assert largest_distance(found, truth, f"USD ({ending})") < STRAIGHT_PARTS


READ_FBX = """
import os, sys
import numpy as np
import ufbx
path, first, last, fps, count, output = sys.argv[1:]
scene = ufbx.load_file(path)
animation = scene.anim_stacks[0].anim
frames = np.zeros((int(last) + 1 - int(first), int(count), 3))
for number in range(len(scene.blend_channels)):
    channel = scene.blend_channels[number]
    places, shapes = [0.0], [np.zeros((int(count), 3))]
    for index in range(len(channel.keyframes)):
        keyframe = channel.keyframes[index]
        shape, dense = keyframe.shape, np.zeros((int(count), 3))
        for row in range(shape.num_offsets):
            vector = shape.position_offsets[row]
            dense[shape.offset_vertices[row]] = vector.x, vector.y, vector.z
        places.append(keyframe.target_weight)
        shapes.append(dense)
    print(channel.name, len(places) - 1, flush=True)
    # Readers go straight from one shape to the next.
    for row in range(len(frames)):
        weight = ufbx.evaluate_blend_weight(animation, channel, (int(first) + row) / float(fps))
        before = int(np.clip(np.searchsorted(places, weight, side="right") - 1, 0, len(places) - 2))
        part = (weight - places[before]) / (places[before + 1] - places[before])
        frames[row] += (1.0 - part) * shapes[before] + part * shapes[before + 1]
np.save(output, frames)
os._exit(0)  # this version of ufbx may crash where it tidies up
"""


def rest_of(obj: bpy.types.Object) -> np.ndarray:
    basis = obj.data.shape_keys.reference_key
    rest = np.empty(3 * len(basis.points), dtype=np.float32)
    basis.points.foreach_get("co", rest)
    return rest.reshape(-1, 3)


def read_fbx(path: Path, rest: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Names of the channels with the number of their shapes, and the motion."""
    frames = path.with_suffix(".npy")
    numbers = [FIRST, LAST, bpy.context.scene.render.fps, len(rest)]
    command = [sys.executable, "-c", READ_FBX, str(path), *map(str, numbers), str(frames)]
    read = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert read.returncode == 0, read.stderr
    return read.stdout.splitlines(), rest + np.load(frames)


def test_fbx(played: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
    truth = motion(played, shown)
    path = tmp_path / "figure.fbx"
    assert export(played, path) == []
    channels, found = read_fbx(path, rest_of(played))
    assert channels == ["Lean 13", "Stretch 1"]
    assert largest_distance(found, truth, "FBX") < STRAIGHT_PARTS


def assert_gltf_moves(path: Path, rest: np.ndarray, truth: np.ndarray) -> None:
    times, found, base = _gltf_motion(path)
    np.testing.assert_allclose(times, np.arange(FIRST, LAST + 1) / bpy.context.scene.render.fps, atol=1e-6)
    # glTF's y is up, and it splits vertices: those of Blender are found by where they are in the base.
    number = np.linalg.norm(rest[None] - base[:, None], axis=2).argmin(axis=1)
    assert np.abs(rest[number] - base).max() < 1e-5
    assert largest_distance(found, truth[:, number], "glTF") < ROUNDING


def test_gltf(played: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
    truth = motion(played, shown)
    path = tmp_path / "figure.glb"
    assert export(played, path) == []
    assert_gltf_moves(path, rest_of(played), truth)


class TestSliders:
    """In-betweens that a slider plays become in-betweens of a shape of its name."""

    # From Stretch to Lean vertices travel about twice as far as from the Basis to Lean.
    BOUND = 2.0 * STRAIGHT_PARTS

    @pytest.fixture(params=["Basis", "Stretch"])
    def slid(self, request: pytest.FixtureRequest, figure: bpy.types.Object) -> bpy.types.Object:
        """The figure with in-betweens from the Basis, or from another key, which an animated slider plays."""
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = FIRST, LAST
        keys = {"from_key": request.param, "to_key": "Lean", "mode": "linear", "easing": "ease-in-out"}
        assert bpy.ops.qc3d.bake_inbetweens(**keys, count=3, play_on="slider") == {"FINISHED"}
        slider = f"{request.param}_to_Lean"
        for frame, value in ((FIRST, 0.0), (LAST, 1.0)):
            figure[slider] = value
            figure.keyframe_insert(f'["{slider}"]', frame=frame)
        return figure

    @staticmethod
    def shapes_of(obj: bpy.types.Object) -> list[str]:
        blocks = obj.data.shape_keys.key_blocks.keys()
        name = "Stretch_to_Lean" if any("Stretch_to_Lean" in one for one in blocks) else "Basis_to_Lean"
        return ["Lean", "Stretch", *([f"{name}_start"] if name.startswith("Stretch") else []), name]

    def test_usd(self, slid: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
        truth = motion(slid, shown)
        path = tmp_path / "figure.usdc"
        assert export(slid, path) == []
        names, found = read_usd(path)
        assert names == self.shapes_of(slid)
        assert largest_distance(found, truth, f"USD, {names[-1]}") < self.BOUND

    def test_fbx(self, slid: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
        truth = motion(slid, shown)
        path = tmp_path / "figure.fbx"
        assert export(slid, path) == []
        channels, found = read_fbx(path, rest_of(slid))
        names = self.shapes_of(slid)
        assert channels == [*(f"{name} 1" for name in names[:-1]), f"{names[-1]} 13"]
        assert largest_distance(found, truth, f"FBX, {names[-1]}") < self.BOUND

    def test_gltf(self, slid: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
        truth = motion(slid, shown)
        path = tmp_path / "figure.glb"
        assert export(slid, path) == []
        assert_gltf_moves(path, rest_of(slid), truth)

    def test_everything_is_as_it_was(
        self, slid: bpy.types.Object, state: Callable[[], dict[str, object]], tmp_path: Path
    ) -> None:
        bpy.context.scene.frame_set(5)
        before = state()
        for ending in (".usda", ".fbx", ".glb"):
            export(slid, tmp_path / f"figure{ending}")
        assert state() == before

    def test_a_slider_that_is_missing_is_said(self, slid: bpy.types.Object, tmp_path: Path) -> None:
        for name in list(slid.keys()):
            del slid[name]
        with pytest.raises(InputError):
            export(slid, tmp_path / "figure.usda")
        assert not list(tmp_path.iterdir())


def _gltf_motion(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (f,), positions (f, m, 3) and positions without targets (m, 3), in Blender's axes."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    document, binary = json.loads(data[20 : 20 + size]), data[28 + size :]

    def array(index: int) -> np.ndarray:
        accessor = document["accessors"][index]
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        values = np.zeros((accessor["count"], width), dtype=np.float32)
        if "bufferView" in accessor:
            view = document["bufferViews"][accessor["bufferView"]]
            start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            values = np.frombuffer(binary, "<f4", values.size, start).reshape(values.shape).copy()
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            kind = {5121: "<u1", 5123: "<u2", 5125: "<u4"}[sparse["indices"]["componentType"]]
            starts = [
                document["bufferViews"][sparse[part]["bufferView"]].get("byteOffset", 0)
                + sparse[part].get("byteOffset", 0)
                for part in ("indices", "values")
            ]
            rows = np.frombuffer(binary, kind, sparse["count"], starts[0])
            values[rows] = np.frombuffer(binary, "<f4", sparse["count"] * width, starts[1]).reshape(-1, width)
        return values.astype(float)

    def in_blender(points: np.ndarray) -> np.ndarray:
        return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)

    [primitive] = document["meshes"][0]["primitives"]
    base = array(primitive["attributes"]["POSITION"])
    targets = np.array([array(target["POSITION"]) for target in primitive["targets"]])
    [[channel, animation]] = [
        [channel, animation]
        for animation in document["animations"]
        for channel in animation["channels"]
        if channel["target"]["path"] == "weights"
    ]
    sampler = animation["samplers"][channel["sampler"]]
    times = array(sampler["input"])[:, 0]
    weights = array(sampler["output"]).reshape(len(times), len(targets))
    return times, in_blender(base + np.tensordot(weights, targets, axes=1)), in_blender(base)


def test_everything_is_as_it_was(
    played: bpy.types.Object, state: Callable[[], dict[str, object]], tmp_path: Path
) -> None:
    bpy.context.scene.frame_set(5)
    before = state()
    for ending in (".usda", ".fbx", ".glb"):
        export(played, tmp_path / f"figure{ending}")
    assert state() == before


class TestHalves:
    """A half is exported as the whole that its Mirror modifier shows, with the same vertices as in Blender."""

    @pytest.fixture
    def half(self, figure: bpy.types.Object) -> bpy.types.Object:
        halve(figure)
        return animated(figure)

    @pytest.fixture
    def rest(self, half: bpy.types.Object, shown: Shown) -> np.ndarray:
        for key in half.data.shape_keys.key_blocks:
            key.mute = True
        found = shown(half).copy()
        for key in half.data.shape_keys.key_blocks:
            key.mute = False
        return found

    @pytest.mark.parametrize("ending", [".usda", ".fbx", ".glb"])
    def test_the_whole_moves(
        self, ending: str, half: bpy.types.Object, rest: np.ndarray, shown: Shown, tmp_path: Path
    ) -> None:
        truth = motion(half, shown)
        assert truth.shape[1] > 1.5 * len(half.data.vertices)
        path = tmp_path / f"figure{ending}"
        assert export(half, path) == []
        if ending == ".glb":
            assert_gltf_moves(path, rest, truth)
            return
        names, found = read_usd(path) if ending == ".usda" else read_fbx(path, rest)
        assert names == (["Lean", "Stretch"] if ending == ".usda" else ["Lean 13", "Stretch 1"])
        assert largest_distance(found, truth, f"half, {ending}") < STRAIGHT_PARTS

    def test_across_two_planes_one_of_them_another_object_s(
        self, figure: bpy.types.Object, shown: Shown, tmp_path: Path
    ) -> None:
        halve(figure)
        animated(figure)
        plane = bpy.data.objects.new("Plane", None)
        bpy.context.collection.objects.link(plane)
        plane.location, plane.rotation_euler = (4.0, 2.5, 3.0), (0.2, 0.1, 0.4)
        bpy.context.view_layer.update()
        figure.modifiers.new("Beside", 'MIRROR').mirror_object = plane
        truth = motion(figure, shown)
        export(figure, tmp_path / "figure.usda")
        assert largest_distance(read_usd(tmp_path / "figure.usda")[1], truth, "two planes") < STRAIGHT_PARTS

    def test_everything_is_as_it_was(
        self, half: bpy.types.Object, state: Callable[[], dict[str, object]], tmp_path: Path
    ) -> None:
        bpy.context.scene.frame_set(5)
        before, mesh = state(), half.data.name
        for ending in (".usda", ".fbx", ".glb"):
            export(half, tmp_path / f"figure{ending}")
        assert state() == before
        assert half.data.name == mesh
        assert half.modifiers[0].show_viewport
        assert half.modifiers[0].show_render

    def test_what_the_modifier_cuts_is_refused(self, played: bpy.types.Object, tmp_path: Path) -> None:
        modifier = played.modifiers.new("Mirror", 'MIRROR')
        modifier.use_bisect_axis[0] = True
        with pytest.raises(InputError, match="cuts its mesh by Bisect"):
            export(played, tmp_path / "figure.usda")
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("how", ["in views", "in this view layer"])
def test_a_hidden_object_is_exported_and_stays_hidden(
    how: str, played: bpy.types.Object, shown: Shown, tmp_path: Path
) -> None:
    truth = motion(played, shown)
    in_views = how == "in views"
    played.hide_viewport = in_views
    played.hide_set(not in_views)
    bpy.context.view_layer.update()
    for ending in (".fbx", ".glb"):
        export(played, tmp_path / f"figure{ending}")
    export(played, tmp_path / "figure.usda")
    assert largest_distance(read_usd(tmp_path / "figure.usda")[1], truth, "hidden") < STRAIGHT_PARTS
    assert (played.hide_viewport, played.hide_get()) == (in_views, not in_views)
    assert bpy.ops.qc3d.export_alembic(filepath=str(tmp_path / "figure.abc"), frames=2) == {"FINISHED"}
    bpy.ops.wm.alembic_import(filepath=str(tmp_path / "figure.abc"), as_background_job=False)
    assert [obj.type for obj in bpy.context.selected_objects] == ["MESH"]


def test_an_object_in_a_hidden_collection_is_refused(played: bpy.types.Object, tmp_path: Path) -> None:
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    hidden.objects.link(played)
    bpy.context.scene.collection.objects.unlink(played)
    hidden.hide_viewport = True
    with pytest.raises(InputError, match="'Figure' is in a hidden collection; show the collection first"):
        export(played, tmp_path / "figure.usda")
    assert not list(tmp_path.iterdir())


def test_what_was_sculpted_since_goes_along(played: bpy.types.Object, tmp_path: Path) -> None:
    between = played.data.shape_keys.key_blocks["Lean_50"]
    values = np.empty(3 * len(between.points), dtype=np.float32)
    between.points.foreach_get("co", values)
    between.points.foreach_set("co", values + 0.5)
    export(played, tmp_path / "figure.usda", 1)
    [shape] = usd_files.read_in_betweens(tmp_path / "figure.usda", len(played.data.vertices))
    assert shape.places.tolist() == [0.5]
    half = 0.5 * shape.offsets[1]
    assert np.abs(shape.offsets[0] - half).max() > 0.4


def test_usd_in_betweens_come_back_as_keys(
    played: bpy.types.Object, shown: Shown, tmp_path: Path
) -> None:
    truth = motion(played, shown)
    path = tmp_path / "figure.usdc"
    export(played, path)
    assert bpy.ops.qc3d.remove() == {"FINISHED"}
    bent = motion(played, shown)
    assert largest_distance(bent, truth, "without in-betweens") > 10.0 * STRAIGHT_PARTS
    assert bpy.ops.qc3d.read_usd(filepath=str(path)) == {"FINISHED"}
    assert sum(key.name.startswith("Lean_") for key in played.data.shape_keys.key_blocks) == 12
    assert largest_distance(motion(played, shown), truth, "USD, read back into Blender") < STRAIGHT_PARTS
    assert bpy.ops.qc3d.remove() == {"FINISHED"}
    np.testing.assert_array_equal(motion(played, shown), bent)


def test_a_file_of_another_mesh_changes_nothing(
    played: bpy.types.Object, state: Callable[[], dict[str, object]], tmp_path: Path
) -> None:
    path = tmp_path / "figure.usda"
    export(played, path)
    before = state()
    with pytest.raises(RuntimeError, match="already"):
        bpy.ops.qc3d.read_usd(filepath=str(path))
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.active_object
    for name in ("Basis", "Lean"):
        cube.shape_key_add(name=name, from_mix=False)
    with pytest.raises(RuntimeError, match="no mesh of 8 vertices"):
        bpy.ops.qc3d.read_usd(filepath=str(path))
    path.write_text("#usda 1.0\n(")
    with pytest.raises(RuntimeError, match="cannot be read as a USD file"):
        bpy.ops.qc3d.read_usd(filepath=str(path))
    bpy.data.objects.remove(cube)
    bpy.context.view_layer.objects.active = played
    played.select_set(True)
    assert state()["keys"][played.data.shape_keys.name] == before["keys"][played.data.shape_keys.name]


@pytest.mark.parametrize("name", ["figure.obj", "figure"])
def test_other_endings_are_refused(name: str, played: bpy.types.Object, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has none of the extensions"):
        export(played, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_without_in_betweens_there_is_nothing_to_export(figure: bpy.types.Object, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no in-betweens"):
        export(figure, tmp_path / "figure.usda")
    assert not bpy.ops.qc3d.export_in_betweens.poll()


def test_the_operator(played: bpy.types.Object, tmp_path: Path) -> None:
    for ending in (".usdc", ".fbx", ".glb"):
        name = str(tmp_path / "figure")
        assert bpy.ops.qc3d.export_in_betweens(filepath=name, format=ending) == {"FINISHED"}
        assert (tmp_path / f"figure{ending}").stat().st_size > 1000
    with pytest.raises(RuntimeError, match="Name a file"):
        bpy.ops.qc3d.export_in_betweens()


@pytest.mark.parametrize("half", [False, True], ids=["subdivision", "subdivision of a mirrored half"])
def test_alembic_has_the_same_vertices_in_every_frame(half: bool, figure: bpy.types.Object, tmp_path: Path) -> None:
    """Modifiers are evaluated in every frame, and a seam that opens would split vertices."""
    if half:
        halve(figure)
    figure.modifiers.new("Subdivision", 'SUBSURF')
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", count=3) == {"FINISHED"}
    path = tmp_path / "figure.abc"
    assert bpy.ops.qc3d.export_alembic(filepath=str(path), frames=9) == {"FINISHED"}
    bpy.ops.object.select_all(action="DESELECT")
    assert bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False) == {"FINISHED"}
    read = bpy.context.selected_objects[0]
    counts = []
    for frame in range(1, 10):
        bpy.context.scene.frame_set(frame)
        counts.append(len(read.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices))
    assert len(set(counts)) == 1
    assert counts[0] > len(figure.data.vertices)
