# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that makes several things is stopped at each of its steps in turn: it never leaves half of them.

A step is the call of one of the add-on's functions. The end of a change is not stopped (the removal of replaced keys,
once everything new exists and is recorded): it consists of Blender's own calls only, none of which can fail.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import bpy
import pytest

from qc3d_addon.blender import live_scrub
from qc3d_addon.blender.bake import map_files
from qc3d_addon.blender.bake import plan as plans
from qc3d_addon.blender.bake.plan import Plan, plan_bake, plan_maps
from qc3d_addon.blender.bake.plan_again import plan_preview
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.chains import absolute_copy, alembic, keyframes, mirror, remove
from qc3d_addon.blender.heat_map import heat_map
from qc3d_addon.blender.keys import shape_keys, slider
from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.frames.preview import PreviewCurve
from qc3d_addon.solver.frames.task import Outcome, carry_out
from qc3d_addon.solver.support.progress import finish

pytestmark = pytest.mark.usefixtures("quick_map")

State = Callable[[], dict[str, Any]]
FOLDER = str(Path(plans.__file__).parents[1])
ENDINGS = (
    shape_keys.remove_keys,
    shape_keys._let_play,
    slider.set_keyframes,
    heat_map.hide,
    keyframes._put_in_place,
    remove.hide_heat_map,
    remove.remove_slider,
    # What an export always does at its end.
    absolute_copy._remove,
    alembic._select,
)
# Blender calls these, and goes on whatever they do.
HANDLERS = tuple(live_scrub._HANDLERS.values())


class Stop(Exception):
    """Raised at a step."""


@contextmanager
def stopped_at(number: int, left_out: Sequence[Callable[..., object]] = ENDINGS) -> Iterator[list[CodeType]]:
    """Raise Stop at the call of a function of the Blender layer, counted from 1; the list gets those called before."""
    called: list[CodeType] = []
    codes = {function.__code__ for function in (*left_out, *HANDLERS)}

    def look(frame: FrameType, event: str, argument: object) -> None:
        code = frame.f_code
        # A generator is called again for each of its values, and to be closed, where no error gets out of it. Those
        # that build a list in one expression are no calls any more since Python 3.12.
        is_step = not code.co_flags & inspect.CO_GENERATOR and not code.co_name.endswith("comp>")
        is_check = code.co_filename.endswith("stored_values.py")  # hundreds of them, which change nothing
        if event != "call" or not code.co_filename.startswith(FOLDER) or not is_step or is_check:
            return
        outer: FrameType | None = frame
        while outer is not None:
            if outer.f_code in codes:
                return
            outer = outer.f_back
        called.append(code)
        if len(called) == number:
            sys.settrace(None)
            raise Stop

    before = sys.gettrace()
    sys.settrace(look)
    try:
        yield called
    finally:
        sys.settrace(before)


def stop_everywhere(work: Callable[[], object], state: State) -> int:
    """Stop the work at each step in turn, with nothing changed, until it runs to its end; the number of steps."""
    before = state()
    for number in range(1, 5000):
        with stopped_at(number) as called:
            try:
                work()
            except Stop:
                pass
            else:
                assert len(called) == number - 1, "the step was stopped without a word"
                return number - 1
        assert state() == before, f"{called[-1].co_qualname}, step {number}"
        bpy.context.view_layer.update()  # what was taken back left nothing that Blender stumbles over
    raise AssertionError("there is no end to it")


def outcome_of(plan: Plan) -> tuple[Plan, Outcome]:
    return plan, finish(carry_out(plan.task))


def request(to_key: str = "Lean", count: int = 2, **choices: Any) -> BakeRequest:  # noqa: ANN401 - of the request
    return BakeRequest(("Basis", to_key), count, play_on="slider", **choices)


@pytest.fixture
def even() -> bpy.types.Object:
    """The active object: a symmetric sphere with the shape keys Basis, Lean and Stretch, and a color of its own."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    obj = bpy.context.active_object
    obj.name = obj.data.name = "Even"
    for name, lean in (("Basis", 0.0), ("Lean", 0.4), ("Stretch", -0.3)):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0
        for point in key.points:
            point.co.x += lean * max(point.co.z, 0.0) ** 2
    obj.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    return obj


@pytest.fixture
def baked(even: bpy.types.Object) -> bpy.types.Object:
    """With a bake, its heat map, and the second key sculpted since."""
    plans.write_bake(*outcome_of(plan_bake(even, request(keyframes=(1, 9)))))
    heat_map.show(even, Record.read(even.data.shape_keys).chains[0], "stretch")
    even.data.shape_keys.key_blocks["Lean"].points[0].co.z += 0.25
    even.active_shape_key_index = 1
    return even


def chain_of(obj: bpy.types.Object) -> tuple[Record, Any]:
    record = Record.read(obj.data.shape_keys)
    return record, record.chains[-1]


@pytest.mark.parametrize(
    "wanted",
    [
        request("Stretch"),
        request("Stretch", keyframes=(3, 7)),
        request("Lean"),
        request("Lean", keyframes=(3, 7)),
        request("Lean", count=4),
        request("Lean", count=4, keyframes=(1, 9)),
    ],
    ids=["new", "new with keyframes", "again", "again, other keyframes", "another number", "another number, keyframes"],
)
def test_a_bake(baked: bpy.types.Object, state: State, wanted: BakeRequest) -> None:
    plan, outcome = outcome_of(plan_bake(baked, wanted))
    assert stop_everywhere(lambda: plans.write_bake(plan, outcome), state) > 50
    assert set(Record.read(baked.data.shape_keys).chains[-1].keys) == set(range(1, wanted.count + 2))
    assert [modifier.name for modifier in baked.modifiers] == [heat_map.NAME]


def test_a_first_bake_with_its_action(even: bpy.types.Object, state: State) -> None:
    plan, outcome = outcome_of(plan_bake(even, request(keyframes=(1, 9))))
    assert stop_everywhere(lambda: plans.write_bake(plan, outcome), state) > 50
    assert even.animation_data.action is not None


def test_a_bake_into_an_action_of_the_animator(even: bpy.types.Object, state: State) -> None:
    even.keyframe_insert("location", frame=3)
    if hasattr(even.animation_data, "action_slot"):
        even.animation_data.action_slot = None
    plan, outcome = outcome_of(plan_bake(even, request(keyframes=(1, 9))))
    assert stop_everywhere(lambda: plans.write_bake(plan, outcome), state) > 50


def test_maps(baked: bpy.types.Object, state: State, tmp_path: Path) -> None:
    plan, outcome = outcome_of(plan_maps(baked, request()))
    assert stop_everywhere(lambda: plans.write_maps(plan, outcome), state) > 20
    plans.write_bake(*outcome_of(plan_bake(baked, request("Stretch"))))
    path = tmp_path / "a.qc3dmap"
    map_files.save_maps(baked, chain_of(baked)[1], path)
    remove.remove_chain(baked, *chain_of(baked))
    assert stop_everywhere(lambda: map_files.load_maps(baked, path), state) > 20
    assert any(kept.to_key == "Stretch" for kept in Record.read(baked.data.shape_keys).maps)


def test_a_mirror_image(baked: bpy.types.Object, state: State) -> None:
    assert stop_everywhere(lambda: mirror.mirror_chain(baked, *chain_of(baked)), state) > 50
    heat_map.show(baked, chain_of(baked)[1], "volume")
    record = Record.read(baked.data.shape_keys)
    baked.data.shape_keys.key_blocks["Basis_to_Lean_33"].points[0].co.z += 0.25
    assert stop_everywhere(lambda: mirror.mirror_chain(baked, record, record.chains[0]), state) > 50


def test_a_copy(baked: bpy.types.Object, state: State) -> None:
    baked.data.materials.append(bpy.data.materials.new("Skin"))
    baked.data.shape_keys.key_blocks["Lean"].keyframe_insert("value", frame=2)
    assert stop_everywhere(lambda: absolute_copy.copy_with_absolute_keys(baked, chain_of(baked)[1]), state) > 20
    assert [obj.name for obj in bpy.data.objects] == ["Even", "Even absolute"]
    assert [mesh.name for mesh in bpy.data.meshes] == ["Even", "Even absolute"]


def test_an_export(baked: bpy.types.Object, state: State, tmp_path: Path) -> None:
    def export() -> None:
        alembic.export_alembic(bpy.context, baked, chain_of(baked)[1], tmp_path / "a.abc", 3)

    before = state()
    assert stop_everywhere(export, state) > 20
    assert [path.name for path in tmp_path.iterdir()] == ["a.abc"]
    assert state() == before


@pytest.mark.parametrize("is_shown", [False, True])
def test_a_heat_map(baked: bpy.types.Object, state: State, is_shown: bool) -> None:
    if not is_shown:
        heat_map.hide(baked)
    assert stop_everywhere(lambda: heat_map.show(baked, chain_of(baked)[1], "dilatation"), state) > 20
    state_of_it = heat_map.shown(baked)
    assert state_of_it is not None
    assert state_of_it.measure == "dilatation"
    assert len(bpy.data.node_groups) == 1
    heat_map.hide(baked)
    assert baked.data.color_attributes.active_color_name == "Paint"


def test_keyframes_in_place_of_drivers(baked: bpy.types.Object, state: State) -> None:
    def convert() -> None:
        keyframes.bake_to_keyframes(bpy.context, baked, *chain_of(baked), range(1, 5))

    assert stop_everywhere(convert, state) > 50
    assert Record.read(baked.data.shape_keys).chains == []


def test_a_preview(baked: bpy.types.Object, state: State) -> None:
    baked.data.shape_keys.key_blocks["Lean"].points[0].co.z -= 0.25
    plan, outcome = outcome_of(plan_preview(baked, chain_of(baked)[1]))
    curve = PreviewCurve(outcome.bake.frames)
    assert stop_everywhere(lambda: live_scrub.begin(plan, chain_of(baked)[1], curve), state) > 10
    assert live_scrub.is_on(baked)


def test_what_was_stopped_while_it_was_removed_can_be_removed_again(even: bpy.types.Object, state: State) -> None:
    """Removing cannot be taken back; it goes on where it was, since the chain is forgotten last."""
    clean = state()
    plan, outcome = outcome_of(plan_bake(even, request(keyframes=(1, 9))))
    for number in range(1, 500):
        plans.write_bake(plan, outcome)
        heat_map.show(even, chain_of(even)[1], "stretch")
        with stopped_at(number, []) as called:
            try:
                remove.remove_chain(even, *chain_of(even))
            except Stop:
                pass
            else:
                assert len(called) == number - 1
                break
        if Record.read(even.data.shape_keys).chains:
            remove.remove_chain(even, *chain_of(even))
        assert state() == clean, number
    assert number > 100
