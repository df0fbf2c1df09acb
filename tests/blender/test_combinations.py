# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys that are on at once: the whole square of their values moves rightly, and the keys are as they were."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.combinations.combine import combine, plan_combination, write_combination
from qc3d_addon.blender.keys.control import value_path
from qc3d_addon.blender.store import combined_keys
from qc3d_addon.solver.combinations.base import KeysOnBase
from qc3d_addon.solver.combinations.composer import Composer
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.worker import client

from ..solver.combinations.arm import arm, posed

Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, object]]
SIDE = (0.0, 1.0, 0.0)
REST, FACES = arm(41, 12)
SIZE = float(np.linalg.norm(np.ptp(REST, axis=0)))
RAISED, BENT, BOTH = posed(REST, 60.0, 0.0), posed(REST, 0.0, 70.0, SIDE), posed(REST, 60.0, 70.0, SIDE)


@pytest.fixture
def rig() -> bpy.types.Object:
    """The active object "Arm" with the shape keys Basis, Bend and Raise."""
    mesh = bpy.data.meshes.new("Arm")
    mesh.from_pydata(REST.tolist(), [], FACES.tolist())
    obj = bpy.data.objects.new("Arm", mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    for name, shape in (("Basis", REST), ("Bend", BENT), ("Raise", RAISED)):
        add_key(obj, name, shape)
    return obj


def add_key(obj: bpy.types.Object, name: str, shape: np.ndarray) -> bpy.types.ShapeKey:
    key = obj.shape_key_add(name=name, from_mix=False)
    key.value = 0.0
    key.points.foreach_set("co", shape.astype(np.float32).ravel())
    return key


def at(obj: bpy.types.Object, shown: Shown, raised: float, bent: float) -> np.ndarray:
    blocks = obj.data.shape_keys.key_blocks
    blocks["Raise"].value, blocks["Bend"].value = raised, bent
    obj.data.shape_keys.update_tag()
    shown(obj)
    return shown(obj).astype(float)


def off(shape: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(shape - truth, axis=1).max()) / SIZE


def test_both_on_is_the_pose_and_each_alone_is_as_it_was(rig: bpy.types.Object, shown: Shown) -> None:
    alone = [at(rig, shown, *values) for values in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.0, 0.3))]
    assert off(at(rig, shown, 1.0, 1.0), BOTH) > 0.3
    made = combine(rig, ["Bend", "Raise"])
    assert made.combined.keys == ("Raise", "Bend")
    assert len(made.combined.made) == 4
    assert off(at(rig, shown, 1.0, 1.0), BOTH) < 1e-5
    for values, before in zip(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.0, 0.3)), alone, strict=True):
        np.testing.assert_allclose(at(rig, shown, *values), before, atol=1e-6)


def test_the_whole_square_moves_rightly(rig: bpy.types.Object, shown: Shown) -> None:
    """At values between those of the keys that were made: what each key shows there, composed."""
    alone = {(n, v): at(rig, shown, *(v * (n == m) for m in range(2))) for n in range(2) for v in (0.25, 0.6, 0.8, 1.0)}
    sums = {(a, b): at(rig, shown, a, b) for a in (0.25, 0.6, 0.8) for b in (0.25, 0.6, 0.8)}
    combine(rig, ["Raise", "Bend"])
    composer = Composer(KeysOnBase(REST, [alone[0, 1.0], alone[1, 1.0]], FACES))
    worst = sums_worst = 0.0
    for (a, b), total in sums.items():
        truth = composer.composed([alone[0, a], alone[1, b]])
        worst = max(worst, off(at(rig, shown, a, b), truth))
        sums_worst = max(sums_worst, off(total, truth))
    print(f"between: {worst:.2g} of the size, the sum {sums_worst:.2g}")
    assert worst < 0.05 * sums_worst


def test_a_muted_key_takes_its_combination_along(rig: bpy.types.Object, shown: Shown) -> None:
    combine(rig, ["Raise", "Bend"])
    rig.data.shape_keys.key_blocks["Raise"].mute = True
    np.testing.assert_allclose(at(rig, shown, 1.0, 1.0), BENT, atol=1e-5)


def test_the_order_can_be_turned(rig: bpy.types.Object, shown: Shown) -> None:
    made = combine(rig, ["Bend", "Raise"], find_order=False)
    assert made.combined.keys == ("Bend", "Raise")
    wrong = at(rig, shown, 1.0, 1.0)
    assert off(wrong, BOTH) > 0.1
    names = [key.name for key in rig.data.shape_keys.key_blocks]
    again = combine(rig, ["Bend", "Raise"])
    assert again.combined.keys == ("Raise", "Bend")
    assert [key.name for key in rig.data.shape_keys.key_blocks] == names
    assert off(at(rig, shown, 1.0, 1.0), BOTH) < 1e-5


def test_a_shape_of_her_own_is_met_and_led_to(rig: bpy.types.Object, shown: Shown) -> None:
    keys = rig.data.shape_keys
    bulge = np.where((np.abs(REST[:, :1] - 2.5) < 0.4), 0.1, 0.0) * [0.0, 0.0, 1.0]
    add_key(rig, "Raise_Bend", REST + (BOTH - RAISED - BENT + REST) + bulge)
    driver = keys.driver_add(value_path("Raise_Bend")).driver
    for name in ("Raise", "Bend"):
        variable = driver.variables.new()
        variable.name = name
        target = variable.targets[0]
        target.id_type, target.id, target.data_path = 'KEY', keys, value_path(name)
    driver.expression = "Raise * Bend"
    own = keys.key_blocks["Raise_Bend"]
    held = np.empty(3 * len(own.points), dtype=np.float32)
    own.points.foreach_get("co", held)
    before = at(rig, shown, 1.0, 1.0)
    half_before = at(rig, shown, 0.5, 0.5)
    halves = [at(rig, shown, 0.5, 0.0), at(rig, shown, 0.0, 0.5)]
    made = combine(rig, ["Raise", "Bend"])
    assert made.is_sculpted
    assert len(made.combined.made) == 3
    np.testing.assert_allclose(at(rig, shown, 1.0, 1.0), before, atol=1e-5)
    now = np.empty_like(held)
    own.points.foreach_get("co", now)
    np.testing.assert_array_equal(now, held)
    assert driver.expression == "Raise * Bend"
    composer = Composer(KeysOnBase(REST, [RAISED, BENT], FACES))
    half, computed = at(rig, shown, 0.5, 0.5), composer.composed(halves)
    assert off(half, computed) < 0.3 * off(half_before, computed)
    # A quarter of the bulge is there, turned with the arm.
    beside = np.linalg.norm(half - computed, axis=1)[np.abs(REST[:, 0] - 2.5) < 0.3]
    np.testing.assert_allclose(beside, 0.025, atol=0.005)


def test_a_shape_of_her_own_that_a_bone_or_property_drives(rig: bpy.types.Object, shown: Shown) -> None:
    own = add_key(rig, "Bend+Raise", BOTH - RAISED - BENT + 2.0 * REST)
    rig["both"] = 0.0
    driver = rig.data.shape_keys.driver_add(value_path(own.name)).driver
    variable = driver.variables.new()
    variable.name, variable.targets[0].id, variable.targets[0].data_path = "v", rig, '["both"]'
    driver.expression = "v"
    made = combine(rig, ["Raise", "Bend"])
    assert made.is_sculpted
    assert driver.expression == "v"
    rig["both"] = 1.0
    assert off(at(rig, shown, 1.0, 1.0), BOTH) < 1e-5


def test_in_betweens_and_drivers_of_the_keys_are_respected(
    rig: bpy.types.Object, shown: Shown, quick_map: object
) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Bend", count=2) == {"FINISHED"}
    keys = rig.data.shape_keys
    rig["raise"] = 0.0
    driver = keys.driver_add(value_path("Raise")).driver
    variable = driver.variables.new()
    variable.name, variable.targets[0].id, variable.targets[0].data_path = "v", rig, '["raise"]'
    driver.expression = "v"
    made = combine(rig, ["Raise", "Bend"])
    assert driver.expression == "v"
    assert len(made.combined.made) == 4
    keys.key_blocks["Bend"].value = 1.0
    shown(rig, **{"raise": 1.0})
    assert off(shown(rig, **{"raise": 1.0}).astype(float), BOTH) < 1e-4
    assert bpy.ops.qc3d.bake_keys(which="all") == {"FINISHED"}  # keys that correct others get no in-betweens


def test_three_keys(rig: bpy.types.Object, shown: Shown) -> None:
    above = np.maximum(REST[:, 0] - 3.2, 0.0)
    add_key(rig, "Wrist", REST + np.stack([0.0 * above, above**2, 0.0 * above], axis=1))
    for pair in (("Raise", "Bend"), ("Raise", "Wrist"), ("Bend", "Wrist")):
        combine(rig, pair)
    made = combine(rig, ["Wrist", "Bend", "Raise"])
    assert made.combined.keys == ("Raise", "Bend", "Wrist")
    rig.data.shape_keys.key_blocks["Wrist"].value = 1.0
    wrist = REST + np.stack([0.0 * above, above**2, 0.0 * above], axis=1)
    truth = Composer(KeysOnBase(REST, [RAISED, BENT, wrist], FACES)).composed([RAISED, BENT, wrist])
    assert off(at(rig, shown, 1.0, 1.0), truth) < 1e-4


def test_a_mirrored_half_moves_as_the_whole_and_its_seam_stays(shown: Shown) -> None:
    upper = (REST[FACES][:, :, 2] > -1e-9).all(axis=1)
    used, faces = np.unique(FACES[upper], return_inverse=True)
    swell = REST * [1.0, 1.0, 1.0] + np.exp(-((REST[:, :1] - 1.1) ** 2) / 0.1) * REST * [0.0, 0.8, 0.8]
    whole = Composer(KeysOnBase(REST, [RAISED, swell], FACES)).composed([RAISED, swell])
    mesh = bpy.data.meshes.new("Half")
    mesh.from_pydata(REST[used].tolist(), [], faces.reshape(-1, 3).tolist())
    obj = bpy.data.objects.new("Half", mesh)
    bpy.context.collection.objects.link(obj)
    for name, shape in (("Basis", REST), ("Raise", RAISED), ("Swell", swell)):
        add_key(obj, name, shape[used])
    obj.modifiers.new("Mirror", 'MIRROR').use_axis = (False, False, True)
    combine(obj, ["Raise", "Swell"])
    obj.modifiers.clear()
    for name in ("Raise", "Swell"):
        obj.data.shape_keys.key_blocks[name].value = 1.0
    obj.data.shape_keys.update_tag()
    shown(obj)
    found = shown(obj).astype(float)
    seam = np.abs(REST[used][:, 2]) < 1e-9
    assert seam.sum() > 50
    assert np.abs(found[seam, 2]).max() < 1e-7
    # The other half of the arm is triangulated another way than the image of this one.
    assert off(found, whole[used]) < 0.1 * off((RAISED + swell - REST)[used], whole[used])


def test_removing_leaves_nothing(rig: bpy.types.Object, state: State) -> None:
    before = state()
    assert bpy.ops.qc3d.combine_keys(first="Raise", second="Bend") == {"FINISHED"}
    assert state() != before
    assert bpy.ops.qc3d.remove_combination(label="Raise + Bend") == {"FINISHED"}
    after = state()
    assert {**after, "keys": None} == {**before, "keys": None}
    assert after["keys"]["Key"]["blocks"] == before["keys"]["Key"]["blocks"]
    assert combined_keys.PROPERTY not in rig.data.shape_keys


def test_what_cannot_be_changes_nothing(rig: bpy.types.Object, state: State) -> None:
    before = state()
    for chosen, said in (
        (["Raise"], "two or three"),
        (["Raise", "Raise"], "'Raise' is named twice"),
        (["Raise", "Lower"], "no shape key 'Lower'"),
        (["Raise", "Basis"], "relative to"),
    ):
        with pytest.raises(InputError, match=said):
            combine(rig, chosen)
    assert state() == before
    combine(rig, ["Raise", "Bend"])
    rig.data.shape_keys.key_blocks["Raise_Bend_50_50"].lock_shape = True
    before = state()
    with pytest.raises(InputError, match="locked"):
        combine(rig, ["Raise", "Bend"])
    with pytest.raises(InputError, match="corrects others"):
        combine(rig, ["Raise", "Raise_Bend_50_50"])
    assert state() == before


@pytest.mark.parametrize("text", ["", "{}", '{"combinations": [{"keys": ["a"], "made": []}]}', "[1]", 7])
def test_a_damaged_record_is_said(text: object, rig: bpy.types.Object) -> None:
    rig.data.shape_keys[combined_keys.PROPERTY] = text
    with pytest.raises(InputError, match="damaged"):
        combine(rig, ["Raise", "Bend"])


def test_verdicts(rig: bpy.types.Object) -> None:
    above = REST[:, :1] > 3.9
    add_key(rig, "Tip", REST + np.where(above, 0.001, 0.0))
    assert bpy.ops.qc3d.judge_pairs() == {"FINISHED"}
    from qc3d_addon.blender.combinations import verdicts

    found = verdicts.found(rig)
    assert [(one.outer, one.inner) for one in found if not one.adding_is_right] == [("Raise", "Bend")]
    assert len(found) == 3


def test_in_a_file_it_plays_without_the_addon(rig: bpy.types.Object, shown: Shown, tmp_path: Path) -> None:
    combine(rig, ["Raise", "Bend"])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "arm.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "arm.blend"), use_scripts=False)
    assert off(at(bpy.data.objects["Arm"], shown, 1.0, 1.0), BOTH) < 1e-5


COMBINE = {"first": "Bend", "second": "Raise"}


def test_the_button_works_in_a_child_process(rig: bpy.types.Object, shown: Shown) -> None:
    assert bpy.ops.qc3d.combine_keys(**COMBINE) == {'FINISHED'}
    assert off(at(rig, shown, 1.0, 1.0), BOTH) < 1e-5
    with pytest.raises(RuntimeError, match="are of two or three keys, and 1 was named"):
        bpy.ops.qc3d.combine_keys(first="Bend")


def test_interrupted_nothing_is_written(
    rig: bpy.types.Object, state: State, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    before = state()
    monkeypatch.setattr(client, "run", interrupted)
    with pytest.raises(RuntimeError, match="Combine Keys was interrupted; nothing was changed"):
        bpy.ops.qc3d.combine_keys(**COMBINE)
    assert state() == before


@pytest.mark.parametrize("which", ["sculpted", "removed", "deleted"])
def test_keys_that_change_meanwhile(rig: bpy.types.Object, which: str) -> None:
    plan = plan_combination(rig, ["Bend", "Raise"])
    corrected = finish(plan.task.carried_out())
    blocks = rig.data.shape_keys.key_blocks
    if which == "sculpted":
        blocks["Bend"].points[0].co.x += 0.5
    elif which == "removed":
        rig.shape_key_remove(blocks["Bend"])
    else:
        bpy.data.objects.remove(rig)
    names = blocks.keys() if which != "deleted" else []
    with pytest.raises(InputError, match="meanwhile; nothing was written"):
        write_combination(plan, corrected)
    if which != "deleted":
        assert blocks.keys() == names


def test_a_combination_of_keys_that_have_changed_since_is_outdated(rig: bpy.types.Object) -> None:
    combine(rig, ["Bend", "Raise"])
    keys = rig.data.shape_keys
    (made,) = combined_keys.read(keys)
    assert not combined_keys.is_outdated(keys, made)
    before = keys.key_blocks["Bend"].points[0].co.x
    keys.key_blocks["Bend"].points[0].co.x += 0.5
    assert combined_keys.is_outdated(keys, made)
    keys.key_blocks["Bend"].points[0].co.x = before
    assert not combined_keys.is_outdated(keys, made)
    keys.key_blocks["Basis"].points[0].co.x += 0.5
    assert combined_keys.is_outdated(keys, made)
    combine(rig, ["Bend", "Raise"])
    assert not combined_keys.is_outdated(keys, combined_keys.read(keys)[0])
    assert not combined_keys.is_outdated(keys, replace(made, digests=()))  # an earlier version did not keep them
