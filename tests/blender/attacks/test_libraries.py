# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters and colliders from linked libraries, re-baked and reloaded."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender import live_scrub
from qc3d_addon.blender.bake.plan import plan_bake, write_bake
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.solver.frames.task import carry_out
from qc3d_addon.solver.support.progress import finish

from ..test_panel_results import drawn

pytestmark = pytest.mark.usefixtures("quick_map")

Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]
SLIDER = "Basis_to_Lean"


@pytest.fixture
def library(figure: bpy.types.Object, tmp_path: Path) -> Path:
    """A file with the baked figure."""
    bake(1)
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def bake(count: int) -> None:
    choices = {"count": count, "mode": "linear"}
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", **choices) == {"FINISHED"}


def linked(path: Path) -> bpy.types.Object:
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.objects = ["Figure"]
    (obj,) = into.objects
    bpy.context.scene.collection.objects.link(obj)
    return obj


def override() -> bpy.types.Object:
    (found,) = [obj for obj in bpy.data.objects if obj.override_library is not None]
    return found


def made_shot(library: Path, count: int) -> Path:
    """A file with the figure overridden, its slider at 0.75; the library was sculpted and baked again since."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    linked(library).override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    override()[SLIDER] = 0.75
    path = library.with_name("shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(library))
    figure = bpy.data.objects["Figure"]
    bpy.context.view_layer.objects.active = figure
    figure.data.shape_keys.key_blocks["Lean"].points[7].co.y += 0.5
    bake(count)
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return path


def leant(part: float) -> np.ndarray:
    """What the figure shows on its way, which is straight here."""
    with bpy.data.libraries.load(bpy.data.libraries[0].filepath) as (_, into):
        into.meshes = ["Figure"]
    (mesh,) = into.meshes
    shapes = []
    for name in ("Basis", "Lean"):
        values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        mesh.shape_keys.key_blocks[name].points.foreach_get("co", values)
        shapes.append(values.reshape(-1, 3))
    bpy.data.meshes.remove(mesh)
    return (1.0 - part) * shapes[0] + part * shapes[1]


def expect_playing(shown: Shown) -> None:
    for place in (0.75, 0.1, 0.5, 1.0):
        np.testing.assert_allclose(shown(override(), **{SLIDER: place}), leant(place), atol=1e-5)


@pytest.mark.parametrize("is_reloaded", [False, True])
def test_an_override_plays_what_its_library_was_baked_to_since(
    library: Path, shown: Shown, is_reloaded: bool
) -> None:
    made_shot(library, count=1)
    if is_reloaded:
        bpy.data.libraries[0].reload()
    assert override()[SLIDER] == 0.75
    expect_playing(shown)


def test_baked_to_another_number_the_override_plays_when_it_is_resynced(library: Path, shown: Shown) -> None:
    """Blender overrides the target of each driver by the driver's number; of new ones it knows from then on."""
    made_shot(library, count=3)
    assert len([key for key in override().data.shape_keys.key_blocks if "_to_" in key.name]) == 4
    assert override().override_library.resync(bpy.context.scene, view_layer=bpy.context.view_layer)
    expect_playing(shown)


def test_what_is_linked_or_overridden_is_not_written_to(library: Path, state: State) -> None:
    made_shot(library, count=1)
    for obj in bpy.data.objects:
        bpy.context.view_layer.objects.active = obj
        drawn(obj)
        before = state()
        for name in ("bake_inbetweens", "rebake", "remove", "mirror", "live_scrub", "to_keyframes", "absolute_keys"):
            with pytest.raises(RuntimeError, match=r"is linked from a library|is a library override"):
                getattr(bpy.ops.qc3d, name)()
        assert state() == before


@pytest.fixture
def off(figure: bpy.types.Object, tmp_path: Path) -> bpy.types.Collection:
    """The linked collection "Off" with a ball in the figure's way."""
    path = tmp_path / "balls.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "figure.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.3, location=(2.0, 0.0, 1.0))
    bpy.context.active_object.name = "Ball"
    collection = bpy.data.collections.new("Off")
    collection.objects.link(bpy.context.active_object)
    bpy.context.scene.collection.children.link(collection)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "figure.blend"))
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.collections = ["Off"]
    bpy.context.scene.collection.children.link(into.collections[0])
    bpy.context.view_layer.update()
    return into.collections[0]


@pytest.mark.parametrize("moved", [False, True])
def test_a_library_of_colliders_is_reloaded_meanwhile(off: bpy.types.Collection, tmp_path: Path, moved: bool) -> None:
    figure = bpy.data.objects["Figure"]
    bpy.context.view_layer.objects.active = figure
    plan = plan_bake(figure, BakeRequest(("Basis", "Lean"), 1, colliders="Off", play_on="slider"))
    outcome = finish(carry_out(plan.task))
    if moved:
        run_elsewhere(tmp_path / "balls.blend", "bpy.data.objects['Ball'].location.x = 3.0")
    bpy.data.libraries[0].reload()
    bpy.context.view_layer.update()
    notes = write_bake(plan, outcome).notes
    said = "The colliders in 'Off' were changed during the bake; re-bake to use their present places."
    assert (said in notes) == moved
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}


def test_live_scrub_goes_on_when_another_library_is_reloaded(off: bpy.types.Collection, shown: Shown) -> None:
    figure = bpy.data.objects["Figure"]
    bpy.context.view_layer.objects.active = figure
    bake(1)
    assert bpy.ops.qc3d.live_scrub() == {"FINISHED"}
    there = shown(figure, **{SLIDER: 0.3})
    bpy.data.libraries[0].reload()
    assert live_scrub.is_on(figure)
    shown(figure, **{SLIDER: 0.9})
    np.testing.assert_array_equal(shown(figure, **{SLIDER: 0.3}), there)


def run_elsewhere(path: Path, script: str) -> None:
    """Open a file in another process, run a script on it, and save it."""
    code = f"import bpy; bpy.ops.wm.open_mainfile(filepath={str(path)!r}); {script}; bpy.ops.wm.save_mainfile()"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
