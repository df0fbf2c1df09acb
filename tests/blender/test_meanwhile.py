# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What may happen to an object between the beginning of a bake and its end: each outcome is defined."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import pytest

from qc3d_addon.blender.bake.plan import Plan, plan_bake, plan_maps, write_bake, write_maps
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.task import Outcome, carry_out
from qc3d_addon.solver.support.progress import finish

pytestmark = pytest.mark.usefixtures("quick_map")

CHANGED = "was changed meanwhile; nothing was written"


@pytest.fixture
def begun(figure: bpy.types.Object) -> tuple[Plan, Outcome]:
    plan = plan_bake(figure, BakeRequest(("Basis", "Lean")))
    return plan, finish(carry_out(plan.task))


def add_a_vertex(figure: bpy.types.Object) -> None:
    mesh = bmesh.new()
    mesh.from_mesh(figure.data)
    mesh.verts.new((0.0, 0.0, 9.0))
    mesh.to_mesh(figure.data)
    mesh.free()


def remove_a_face(figure: bpy.types.Object) -> None:
    mesh = bmesh.new()
    mesh.from_mesh(figure.data)
    mesh.faces.ensure_lookup_table()
    bmesh.ops.delete(mesh, geom=[mesh.faces[3]], context='FACES_ONLY')
    mesh.to_mesh(figure.data)
    mesh.free()


def sculpt(figure: bpy.types.Object) -> None:
    figure.data.shape_keys.key_blocks["Lean"].points[5].co.x += 0.25


def rename_the_key(figure: bpy.types.Object) -> None:
    figure.data.shape_keys.key_blocks["Lean"].name = "Bow"


def remove_the_key(figure: bpy.types.Object) -> None:
    figure.shape_key_remove(figure.data.shape_keys.key_blocks["Lean"])


def remove_all_keys(figure: bpy.types.Object) -> None:
    figure.shape_key_clear()


def edit(figure: bpy.types.Object) -> None:
    bpy.ops.object.mode_set(mode='EDIT')


def delete(figure: bpy.types.Object) -> None:
    bpy.data.objects.remove(figure)


def exchange_the_mesh(figure: bpy.types.Object) -> None:
    bpy.ops.mesh.primitive_cube_add()
    figure.data = bpy.context.active_object.data


def make_absolute(figure: bpy.types.Object) -> None:
    figure.data.shape_keys.use_relative = False


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (add_a_vertex, CHANGED),
        (remove_a_face, CHANGED),
        (sculpt, CHANGED),
        (rename_the_key, CHANGED),
        (remove_the_key, CHANGED),
        (remove_all_keys, "has fewer than two shape keys"),
        (edit, "is being edited"),
        (delete, "'Figure' was deleted meanwhile; nothing was written"),
        (exchange_the_mesh, "has fewer than two shape keys"),
        (make_absolute, "are absolute"),
    ],
)
def test_nothing_is_written(
    begun: tuple[Plan, Outcome],
    figure: bpy.types.Object,
    state: Callable[[], dict[str, Any]],
    change: Callable[[bpy.types.Object], None],
    said: str,
) -> None:
    change(figure)
    before = state()
    with pytest.raises(InputError, match=said):
        write_bake(*begun)
    with pytest.raises(InputError, match=said):
        write_maps(*begun)
    assert state() == before


def test_another_file_has_another_object_of_that_name(begun: tuple[Plan, Outcome]) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    other = bpy.context.active_object
    other.name = "Figure"
    for name in ("Basis", "Lean"):
        other.shape_key_add(name=name, from_mix=False)
    assert other.session_uid != begun[0].object_id
    with pytest.raises(InputError, match="was deleted meanwhile"):
        write_bake(*begun)
    assert len(other.data.shape_keys.key_blocks) == 2


def rename_the_object(figure: bpy.types.Object) -> None:
    figure.name = "Somebody"


def move(figure: bpy.types.Object) -> None:
    figure.location.x = 5.0


def add_another_key(figure: bpy.types.Object) -> None:
    figure.shape_key_add(name="New", from_mix=False)


def lock_and_mute(figure: bpy.types.Object) -> None:
    key = figure.data.shape_keys.key_blocks["Lean"]
    key.lock_shape = key.mute = True


@pytest.mark.parametrize("change", [rename_the_object, move, add_another_key, lock_and_mute])
def test_what_is_no_obstacle(
    begun: tuple[Plan, Outcome], figure: bpy.types.Object, change: Callable[[bpy.types.Object], None]
) -> None:
    change(figure)
    made = write_bake(*begun)
    assert made.slider_object == figure.name
    assert set(made.keys) <= set(figure.data.shape_keys.key_blocks.keys())


def test_a_bake_of_the_same_keys_in_between_is_replaced(begun: tuple[Plan, Outcome], figure: bpy.types.Object) -> None:
    bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", count=6)
    made = write_bake(*begun)
    generated = [name for name in figure.data.shape_keys.key_blocks.keys() if "→" in name]  # noqa: SIM118
    assert generated == [name for name in made.keys if "→" in name]


def test_maps_are_planned_and_written_alike(figure: bpy.types.Object) -> None:
    plan = plan_maps(figure, BakeRequest(("Basis", "Lean")))
    outcome = finish(carry_out(plan.task))
    rename_the_object(figure)
    write_maps(plan, outcome)
    assert any(name.startswith("qc3d_map_") for name in figure.data.shape_keys.keys())  # noqa: SIM118
