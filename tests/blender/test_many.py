# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many keys in one run: each on itself, with a verdict, and those that need nothing left alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.bake.many import Verdict, bakeable_keys, plan_keys
from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.bake.run import bake_object_keys
from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.errors import CanceledError, InputError
from qc3d_addon.solver.frames.many import Ended, Run
from qc3d_addon.solver.settings import FrameOptions
from qc3d_addon.worker import client

from .conftest import add_key

pytestmark = pytest.mark.usefixtures("quick_map")

State = Callable[[], dict[str, Any]]
# A changing speed, which the straight blend does not have.
EASED = BakeRequest(("", ""), 2, frame_options=FrameOptions("linear", "ease-in-out"))


@pytest.fixture
def face(figure: bpy.types.Object) -> bpy.types.Object:
    """The figure with a key that shows nothing, one that cannot be used, and one relative to another."""
    add_key(figure, "Nothing", lambda rest: rest)
    add_key(figure, "Broken", lambda rest: np.full_like(rest, np.nan))
    wide = add_key(figure, "Wide", lambda rest: rest * [1.5, 1.0, 1.0])
    wide.relative_key = figure.data.shape_keys.key_blocks["Lean"]
    return figure


def on_keys(obj: bpy.types.Object) -> list[str]:
    return [chain.on_key for chain in Record.read(obj.data.shape_keys).chains]


def ends(verdicts: list[Verdict]) -> dict[str, str]:
    return {verdict.key: verdict.ended for verdict in verdicts}


def test_every_key_has_a_verdict(face: bpy.types.Object, quick_map: list[Any]) -> None:
    verdicts = bake_object_keys(face, [], EASED)
    wanted = {"Lean": "baked", "Stretch": "baked", "Nothing": "left", "Broken": "failed", "Wide": "baked"}
    assert ends(verdicts) == wanted
    words = {verdict.key: verdict.text for verdict in verdicts}
    assert words["Lean"].startswith("2 in-betweens")
    assert words["Nothing"] == "has the same shape as 'Basis'"
    assert "not finite" in words["Broken"]
    assert on_keys(face) == ["Lean", "Stretch", "Wide"]
    assert face.data.shape_keys.key_blocks["Wide_33"].relative_key.name == "Lean"
    made, names = len(quick_map), face.data.shape_keys.key_blocks.keys()
    again = ends(bake_object_keys(face, [], EASED))
    assert again == {**wanted, "Lean": "left", "Stretch": "left", "Wide": "left"}
    assert len(quick_map) == made
    assert face.data.shape_keys.key_blocks.keys() == names
    face.data.shape_keys.key_blocks["Stretch"].points[0].co.x += 0.5  # sculpted since
    assert ends(bake_object_keys(face, [], EASED))["Stretch"] == "baked"
    bpy.ops.qc3d.remove(slider="Lean")
    assert ends(bake_object_keys(face, ["Lean", "Lean"], EASED)) == {"Lean": "baked"}


def test_a_key_that_moves_straight_needs_none(figure: bpy.types.Object, state: State) -> None:
    before = state()
    even = BakeRequest(("", ""), 2, frame_options=FrameOptions("linear"))
    (verdict,) = bake_object_keys(figure, ["Lean"], even)
    assert (verdict.ended, verdict.text) == ("straight", "straight is enough: 0.00%")
    assert state() == before


def test_what_a_bake_made_and_the_basis_are_no_keys_to_bake(figure: bpy.types.Object) -> None:
    bake_object_keys(figure, [], EASED)
    assert bakeable_keys(figure) == ["Lean", "Stretch"]
    for name in ("Basis", "Lean_33"):
        with pytest.raises(InputError, match=f"'{name}' cannot play in-betweens"):
            bake_object_keys(figure, [name], EASED)
    with pytest.raises(InputError, match="no shape key 'Grin' on 'Figure'"):
        bake_object_keys(figure, ["Grin"], EASED)


CHOICES = {"mode": "linear", "easing": "ease-in-out", "count": 2}


def test_the_operator(face: bpy.types.Object, capfd: pytest.CaptureFixture[str]) -> None:
    assert bpy.ops.qc3d.bake_keys(**CHOICES) == {"FINISHED"}
    assert on_keys(face) == ["Lean", "Stretch", "Wide"]
    said = "".join(capfd.readouterr())
    assert "Lean: 2 in-betweens" in said
    assert "3 of 5 keys got in-betweens; 1 were left as they are; 1 cannot be baked." in said
    assert bpy.ops.qc3d.bake_keys(**CHOICES) == {"FINISHED"}
    assert "0 of 5 keys got in-betweens; 4 were left as they are; 1 cannot be baked." in "".join(capfd.readouterr())


def test_the_operator_with_some_keys(face: bpy.types.Object) -> None:
    keys = [{"name": "Stretch"}]
    assert bpy.ops.qc3d.bake_keys(which="named", keys=keys, **CHOICES) == {"FINISHED"}
    assert on_keys(face) == ["Stretch"]
    blocks = face.data.shape_keys.key_blocks
    if not hasattr(blocks["Lean"], "select"):  # before Blender 5
        with pytest.raises(RuntimeError, match="No shape key of 'Figure' is chosen"):
            bpy.ops.qc3d.bake_keys(which="selected", **CHOICES)
        return
    for key in blocks:
        key.select = key.name in ("Basis", "Lean")
    assert bpy.ops.qc3d.bake_keys(which="selected", **CHOICES) == {"FINISHED"}
    assert on_keys(face) == ["Stretch", "Lean"]


def test_interrupted_nothing_is_written(
    face: bpy.types.Object, state: State, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = state()

    def interrupted(job: Run, *_: object) -> object:
        for step in job.carried_out():
            if isinstance(step, Ended):
                raise KeyboardInterrupt
        raise AssertionError("nothing has ended")

    monkeypatch.setattr(client, "run", interrupted)
    with pytest.raises(RuntimeError, match="was interrupted; nothing was changed"):
        bpy.ops.qc3d.bake_keys(**CHOICES)
    assert state() == before


def test_twenty_keys_of_a_face(figure: bpy.types.Object) -> None:
    for number in range(20):
        add_key(figure, f"Shape {number}", lambda rest, n=number: rest + [0.0, 0.3, 0.1] * np.sin(rest[:, :1] * n))
    verdicts = bake_object_keys(figure, [], EASED)
    assert len(verdicts) == 22
    assert set(ends(verdicts).values()) == {"baked", "left"}  # the first of them shows nothing
    assert len(on_keys(figure)) == 21


def test_what_is_done_is_written_after_a_cancel(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    plan = plan_keys(figure, ["Lean", "Stretch"], EASED, 0.0)
    (first, *_) = plan.task.outcomes()
    verdicts = plan.write([first, CanceledError("was not reached before the bake was canceled")])
    assert ends(verdicts) == {"Lean": "baked", "Stretch": "left"}
    assert verdicts[1].text == "was not reached before the bake was canceled"
    assert on_keys(figure) == ["Lean"]


def test_a_key_that_would_take_too_much_memory(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    plan = plan_keys(figure, ["Lean"], EASED, 20.0)
    assert plan.task.tasks == ()
    assert [verdict.ended for verdict in plan.write([])] == ["failed"]


def test_the_volume_around_a_base_is_made_once(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    add_key(figure, "Nod", lambda rest: rest + np.maximum(rest[:, 2:], 0.0) ** 2 * [0.0, 0.2, -0.05])
    bake_object_keys(figure, ["Lean", "Nod"], EASED)
    assert len(quick_map) == 1
