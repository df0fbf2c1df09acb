# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colliders of a bake: which objects count, where they are, and the messages if there are none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.bake import plan as plans
from qc3d_addon.blender.bake.colliders import read_colliders
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.collision.colliders import Collider
from qc3d_addon.solver.frames.task import carry_out
from qc3d_addon.solver.support.progress import finish

THROUGH = ("Basis", "Lean")
State = Callable[[], dict[str, Any]]


@pytest.fixture
def ball(figure: bpy.types.Object) -> bpy.types.Object:
    """A small sphere in the collection "Off", in the way of the figure's Lean."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.3, location=(2.0, 0.0, 1.0))
    obj = bpy.context.active_object
    obj.name = "Ball"
    collection = bpy.data.collections.new("Off")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(obj)
    bpy.context.view_layer.objects.active = figure
    bpy.context.view_layer.update()
    return obj


def read(figure: bpy.types.Object, name: str = "Off") -> Collider:
    found = read_colliders(figure, name, THROUGH)
    assert found is not None
    return found


def volume(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = points[faces.T]
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_hidden_ones_count_as_if_they_were_shown(figure: bpy.types.Object, ball: bpy.types.Object) -> None:
    ball.modifiers.new("Smooth", "SUBSURF")
    ball.hide_viewport = True
    ball.location.x += 1.0
    bpy.context.view_layer.update()
    hidden = read(figure)
    ball.hide_viewport = False
    bpy.context.view_layer.update()
    shown = read(figure)
    assert len(hidden.shapes[0]) > len(ball.data.vertices)
    np.testing.assert_array_equal(hidden.shapes, shown.shapes)


def test_seen_from_the_object(figure: bpy.types.Object, ball: bpy.types.Object) -> None:
    figure.location, figure.scale = (1.0, 0.0, 0.0), (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    found = read(figure)
    assert not found.moves
    np.testing.assert_allclose(found.shapes[0].mean(axis=0), [0.5, 0.0, 0.5], atol=1e-5)
    np.testing.assert_allclose(np.ptp(found.shapes[0], axis=0), 0.3, rtol=0.1)
    assert volume(found.shapes[0], found.faces) > 0.0


def test_modifiers_count_and_mirrored_objects_face_outwards(figure: bpy.types.Object, ball: bpy.types.Object) -> None:
    ball.modifiers.new("Subdivision", 'SUBSURF').levels = 1
    ball.scale.x = -1.0
    bpy.context.view_layer.update()
    found = read(figure)
    assert found.shapes.shape[1] > 4 * len(ball.data.vertices) - 10
    assert volume(found.shapes[0], found.faces) > 0.0


def test_keys_of_the_same_names_move_along(figure: bpy.types.Object, ball: bpy.types.Object) -> None:
    ball.shape_key_add(name="Basis")
    moved = ball.shape_key_add(name="Lean")
    for point in moved.points:
        point.co.y += 1.0
    found = read(figure)
    assert found.moves
    np.testing.assert_allclose(found.shapes[1] - found.shapes[0], np.broadcast_to([0.0, 1.0, 0.0], (42, 3)), atol=1e-6)
    moved.name = "Other"
    assert not read(figure).moves


def test_the_object_itself_and_other_kinds_are_left_out(figure: bpy.types.Object, ball: bpy.types.Object) -> None:
    bpy.data.collections["Off"].objects.link(figure)
    bpy.data.collections["Off"].objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", 'POINT')))
    assert read(figure).shapes.shape[1] == 42
    assert read_colliders(figure, "", THROUGH) is None


@pytest.mark.usefixtures("quick_map")
class TestBake:
    def test_it_is_asked_for_and_remembered(
        self, figure: bpy.types.Object, ball: bpy.types.Object, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        seen = []
        plan_bake = plans.plan_bake

        def planned(*arguments: Any) -> plans.Plan:  # noqa: ANN401
            seen.append(plan_bake(*arguments))
            return seen[-1]

        from qc3d_addon.blender.operators import bake_inbetweens

        monkeypatch.setattr(bake_inbetweens, "plan_bake", planned)
        assert bpy.ops.qc3d.bake_inbetweens(
            play_on="slider", from_key="Basis", to_key="Lean", colliders="Off"
        ) == {'FINISHED'}
        result = Record.read(figure.data.shape_keys).chains[0].result
        assert result.collider_crossings == 0
        ball.location.x = 3.0
        bpy.context.view_layer.update()
        assert bpy.ops.qc3d.rebake() == {'FINISHED'}
        first, again = (plan.task.collider for plan in seen)
        moved = again.shapes - first.shapes
        np.testing.assert_allclose(moved, np.broadcast_to([1.0, 0.0, 0.0], moved.shape), atol=1e-5)
        bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean")
        assert Record.read(figure.data.shape_keys).chains[0].result.collider_crossings is None

    def test_the_panel_names_it_too(self, figure: bpy.types.Object, ball: bpy.types.Object) -> None:
        figure.qc3d.from_key, figure.qc3d.to_key, figure.qc3d.colliders = "Basis", "Lean", "Off"
        assert bpy.ops.qc3d.bake_inbetweens(play_on="slider") == {'FINISHED'}
        assert Record.read(figure.data.shape_keys).chains[0].request["colliders"] == "Off"

    @pytest.mark.parametrize(
        ("name", "sentence"), [("None", "no collection 'None'"), ("Empty", "has no other meshes with faces")]
    )
    def test_no_collider(self, figure: bpy.types.Object, state: State, name: str, sentence: str) -> None:
        bpy.data.collections.new("Empty").objects.link(figure)
        before = state()
        with pytest.raises(RuntimeError, match=sentence):
            bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", colliders=name)
        assert state() == before


class TestMeanwhile:
    """What happens to the objects between the beginning of a bake and its end."""

    SENTENCE = "The colliders in 'Off' were changed during the bake; re-bake to use their present places."

    def notes(self, figure: bpy.types.Object, change: Callable[[], object]) -> tuple[str, ...]:
        plan = plans.plan_bake(figure, BakeRequest(THROUGH, 1, colliders="Off", play_on="slider"))
        outcome = finish(carry_out(plan.task))
        change()
        bpy.context.view_layer.update()
        return plans.write_bake(plan, outcome).notes

    @pytest.mark.usefixtures("quick_map")
    @pytest.mark.parametrize(
        "change",
        [
            lambda: setattr(bpy.data.objects["Ball"], "location", (2.5, 0.0, 0.0)),
            lambda: setattr(bpy.data.objects["Figure"], "location", (0.5, 0.0, 0.0)),
            lambda: bpy.data.objects["Ball"].modifiers.new("Finer", 'SUBSURF'),
            lambda: bpy.data.objects.remove(bpy.data.objects["Ball"]),
            lambda: setattr(bpy.data.collections["Off"], "name", "Other"),
        ],
        ids=["moved", "seen from elsewhere", "finer", "deleted", "collection renamed"],
    )
    def test_a_change_is_said(
        self, figure: bpy.types.Object, ball: bpy.types.Object, change: Callable[[], object]
    ) -> None:
        assert self.SENTENCE in self.notes(figure, change)
        assert self.SENTENCE in Record.read(figure.data.shape_keys).chains[0].result.notes

    @pytest.mark.usefixtures("quick_map")
    def test_no_change(self, figure: bpy.types.Object, ball: bpy.types.Object) -> None:
        assert self.SENTENCE not in self.notes(figure, lambda: setattr(ball, "name", "Globe"))
