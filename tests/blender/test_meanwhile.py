# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes to an object while a bake runs: each has a defined outcome."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest

from qc3d_addon.blender import live_scrub
from qc3d_addon.blender.bake.plan import Plan, plan_bake, plan_maps, write_bake, write_maps
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.task import Outcome, carry_out
from qc3d_addon.solver.support.progress import finish

pytestmark = pytest.mark.usefixtures("quick_map")

Shown = Callable[..., np.ndarray]
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]
State = Callable[[], dict[str, Any]]
CHANGED = "was changed meanwhile; nothing was written"


@pytest.fixture
def begun(figure: bpy.types.Object) -> tuple[Plan, Outcome]:
    plan = plan_bake(figure, BakeRequest(("Basis", "Lean"), play_on="slider"))
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


def damage_the_record(figure: bpy.types.Object) -> None:
    figure.data.shape_keys["qc3d"] = "{"


def write_a_later_record(figure: bpy.types.Object) -> None:
    figure.data.shape_keys["qc3d"] = '{"version": 99}'


def sculpt_through_another_object(figure: bpy.types.Object) -> None:
    twin = bpy.data.objects.new("Twin", figure.data)
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.objects.active = twin
    bpy.ops.object.mode_set(mode='SCULPT')


def exchange_two_keys(figure: bpy.types.Object) -> None:
    keys = figure.data.shape_keys.key_blocks
    keys["Lean"].name = "Lean for a moment"
    keys["Stretch"].name = "Lean"
    keys["Lean for a moment"].name = "Stretch"


def put_a_linked_mesh_in_its_place(figure: bpy.types.Object) -> None:
    folder = bpy.app.tempdir
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/library.blend", copy=True)
    with bpy.data.libraries.load(f"{folder}/library.blend", link=True) as (_, linked):
        linked.meshes = ["Figure"]
    figure.data = linked.meshes[0]


def link_another_of_the_same_name(figure: bpy.types.Object) -> None:
    """The object that was planned for is deleted; one of the same name is there, from a library."""
    folder = bpy.app.tempdir
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/library.blend", copy=True)
    bpy.data.objects.remove(figure)
    with bpy.data.libraries.load(f"{folder}/library.blend", link=True) as (_, linked):
        linked.objects = ["Figure"]
    bpy.context.scene.collection.objects.link(linked.objects[0])


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
        (damage_the_record, "The record of earlier bakes on 'Key' is damaged"),
        (write_a_later_record, "was written by a later version of QC3D"),
        (sculpt_through_another_object, "'Twin', which shares its mesh, is being edited"),
        (exchange_two_keys, CHANGED),
        (put_a_linked_mesh_in_its_place, "is linked from a library"),
        (link_another_of_the_same_name, "'Figure' was deleted meanwhile; nothing was written"),
    ],
)
def test_nothing_is_written(
    begun: tuple[Plan, Outcome],
    figure: bpy.types.Object,
    state: State,
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


def put_first(figure: bpy.types.Object, name: str) -> None:
    """Move a key to the top, where all others refer to it."""
    keys = figure.data.shape_keys.key_blocks
    figure.active_shape_key_index = keys.find(name)
    while keys.find(name) > 0:
        if bpy.ops.object.shape_key_move(type='UP') == {'CANCELLED'}:
            pytest.skip("this version of Blender keeps the first key where it is")
    assert figure.data.shape_keys.reference_key.name == name


def put_another_key_first(figure: bpy.types.Object) -> None:
    put_first(figure, "Stretch")


def put_the_last_key_first(figure: bpy.types.Object) -> None:
    put_first(figure, "Lean")


def move_the_first_key_down(figure: bpy.types.Object) -> None:
    figure.active_shape_key_index = 0
    bpy.ops.object.shape_key_move(type='BOTTOM')


def sculpt_another_key(figure: bpy.types.Object) -> None:
    figure.data.shape_keys.key_blocks["Stretch"].points[5].co.x += 0.25


def give_it_a_modifier(figure: bpy.types.Object) -> None:
    figure.modifiers.new("Finer", 'SUBSURF')


@pytest.mark.parametrize(
    "change",
    [
        rename_the_object,
        move,
        add_another_key,
        lock_and_mute,
        put_another_key_first,
        put_the_last_key_first,
        move_the_first_key_down,
        sculpt_another_key,
        give_it_a_modifier,
    ],
)
def test_what_is_no_obstacle(
    begun: tuple[Plan, Outcome], figure: bpy.types.Object, change: Callable[[bpy.types.Object], None], shown: Shown
) -> None:
    frames = begun[1].bake.frames
    change(figure)
    made = write_bake(*begun)
    assert made.slider_object == figure.name
    assert set(made.keys) <= set(figure.data.shape_keys.key_blocks.keys())
    if not figure.modifiers:
        for step, frame in enumerate(frames):  # whatever the first key is now
            seen = shown(figure, **{made.slider: step / (len(frames) - 1)})
            np.testing.assert_allclose(seen, frame, atol=1e-5)


def test_a_bake_of_the_same_keys_in_between_is_replaced(begun: tuple[Plan, Outcome], figure: bpy.types.Object) -> None:
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=6)
    made = write_bake(*begun)
    generated = [name for name in figure.data.shape_keys.key_blocks.keys() if "_to_" in name]  # noqa: SIM118
    assert sorted(generated) == sorted(name for name in made.keys if "_to_" in name)


def test_maps_are_planned_and_written_alike(figure: bpy.types.Object) -> None:
    plan = plan_maps(figure, BakeRequest(("Basis", "Lean"), play_on="slider"))
    outcome = finish(carry_out(plan.task))
    rename_the_object(figure)
    write_maps(plan, outcome)
    assert any(name.startswith("qc3d_map_") for name in figure.data.shape_keys.keys())  # noqa: SIM118


def test_the_first_key_is_deleted(figure: bpy.types.Object, shown: Shown) -> None:
    """The next one takes its place, for a bake between other keys as for one that is there already."""
    plan = plan_bake(figure, BakeRequest(("Lean", "Stretch"), 1, play_on="slider"))
    outcome = finish(carry_out(plan.task))
    write_bake(plan, outcome)
    for delete in (False, True):
        if delete:
            figure.shape_key_remove(figure.data.shape_keys.reference_key)
            assert figure.data.shape_keys.reference_key.name == "Lean"
        made = write_bake(plan, outcome)
        for step, frame in enumerate(outcome.bake.frames):
            np.testing.assert_allclose(shown(figure, **{made.slider: step / 2}), frame, atol=1e-5)


class TestBetweenTwoBakes:
    """A bake is in the file already when the next one is planned; this happens before that one is written."""

    SLIDER = "Basis_to_Lean"

    @pytest.fixture
    def again(self, figure: bpy.types.Object) -> tuple[Plan, Outcome]:
        write_bake(*planned(figure, count=1))
        figure.data.shape_keys.key_blocks["Lean"].points[3].co.x += 0.25
        return planned(figure, count=1)

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            ("del obj[slider]; obj[slider] = 'text'", "is no longer a number"),
            ("obj[slider] = float('nan')", "has no value"),
        ],
    )
    def test_what_stands_in_the_way(
        self, again: tuple[Plan, Outcome], figure: bpy.types.Object, state: State, change: str, said: str
    ) -> None:
        key = figure.data.shape_keys.key_blocks[f"{self.SLIDER}_50"]
        exec(change, {"obj": figure, "key": key, "slider": self.SLIDER})
        before = repr(state())
        with pytest.raises(InputError, match=said):
            write_bake(*again)
        assert repr(state()) == before

    def test_its_slider_is_deleted(self, again: tuple[Plan, Outcome], figure: bpy.types.Object, shown: Shown) -> None:
        del figure[self.SLIDER]
        made = write_bake(*again)
        np.testing.assert_allclose(shown(figure, **{made.slider: 0.5}), again[1].bake.frames[1], atol=1e-6)

    def test_a_made_key_is_moved_to_the_top(
        self, again: tuple[Plan, Outcome], figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        """Everything refers to it from then on: it is no in-between any more, and is not written to."""
        there = shapes(figure)[f"{self.SLIDER}_50"]
        put_first(figure, f"{self.SLIDER}_50")
        made = write_bake(*again)
        np.testing.assert_array_equal(shapes(figure)[f"{self.SLIDER}_50"], there)
        for step, frame in enumerate(again[1].bake.frames):
            np.testing.assert_allclose(shown(figure, **{made.slider: step / 2}), frame, atol=1e-5)
        assert bpy.ops.qc3d.remove() == {'FINISHED'}
        assert list(shapes(figure)) == [f"{self.SLIDER}_50", "Basis", "Lean", "Stretch"]

    def test_its_slider_belongs_to_an_object_that_is_deleted(
        self, figure: bpy.types.Object, shown: Shown
    ) -> None:
        twin = bpy.data.objects.new("Twin", figure.data)
        bpy.context.scene.collection.objects.link(twin)
        write_bake(*planned(figure, count=1))
        plan, outcome = planned(twin, count=1)
        bpy.data.objects.remove(figure)
        made = write_bake(plan, outcome)
        assert made.slider_object == "Twin"
        np.testing.assert_allclose(shown(twin, **{made.slider: 0.5}), outcome.bake.frames[1], atol=1e-6)

    def test_its_mesh_is_made_its_own(
        self, figure: bpy.types.Object, shapes: ReadShapes, record: Callable[..., Any]
    ) -> None:
        """Two objects shared it: what is written goes to the one that was planned for."""
        twin = bpy.data.objects.new("Twin", figure.data)
        bpy.context.scene.collection.objects.link(twin)
        write_bake(*planned(figure, count=1))
        plan, outcome = planned(twin, count=4)
        before = shapes(figure)
        twin.data = twin.data.copy()
        write_bake(plan, outcome)
        for name, shape in shapes(figure).items():
            np.testing.assert_array_equal(shape, before[name])
        assert list(shapes(figure)) == list(before)
        assert len([name for name in shapes(twin) if "_to_" in name]) == 5
        assert [chain.intervals for chain in (*record(figure).chains, *record(twin).chains)] == [2, 5]

    def test_all_of_it_is_removed(
        self, again: tuple[Plan, Outcome], figure: bpy.types.Object, shapes: ReadShapes, record: Callable[..., Any]
    ) -> None:
        bpy.ops.qc3d.remove()
        write_bake(*again)
        assert [name for name in shapes(figure) if "_to_" in name] == [f"{self.SLIDER}_50", f"{self.SLIDER}_100"]
        assert len(record(figure).chains) == 1

    def test_another_bake_comes_first(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown, record: Callable[..., Any]
    ) -> None:
        """Both were planned when nothing was baked, and other keys are written first: neither touches the other."""
        bakes = [planned(figure, to_key, count=count) for to_key, count in (("Lean", 1), ("Stretch", 2))]
        made = [write_bake(*bake) for bake in reversed(bakes)][::-1]
        assert len({result.slider for result in made}) == 2
        assert len(record(figure).chains) == 2
        assert len(record(figure).maps) == 2
        for (_, outcome), result in zip(bakes, made, strict=True):
            for step, frame in enumerate(outcome.bake.frames):
                place = step / (len(outcome.bake.frames) - 1)
                np.testing.assert_allclose(shown(figure, **{result.slider: place}), frame, atol=1e-6)
            figure[result.slider] = 0.0


def planned(figure: bpy.types.Object, to_key: str = "Lean", **choices: int) -> tuple[Plan, Outcome]:
    plan = plan_bake(figure, BakeRequest(("Basis", to_key), play_on="slider", **choices))
    return plan, finish(carry_out(plan.task))


def test_live_scrub_goes_on_with_the_steps_that_undo_brought_back(
    figure: bpy.types.Object, shown: Shown
) -> None:
    write_bake(*planned(figure, count=3))
    keys = figure.data.shape_keys
    bpy.ops.qc3d.live_scrub()
    place = {"Basis_to_Lean": 0.3}
    expected = shown(figure, **place)
    write_bake(*planned(figure, count=1))  # as undo brings back an earlier bake, without a word to anybody
    live_scrub._after_undo()
    assert live_scrub.is_on(figure)
    assert live_scrub.KEY in keys.key_blocks
    np.testing.assert_allclose(shown(figure, **place), expected, atol=1e-4)
