# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A tolerance bakes as few in-betweens as it needs, as shape keys."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.bake.request import DENSE_STEPS
from qc3d_addon.blender.store.records import Chain, Record

SLIDER = "Basis→Bent"
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]

pytestmark = pytest.mark.usefixtures("work_here")


@pytest.fixture
def bar() -> bpy.types.Object:
    """The active object "Bar": a box of height 4 whose upper half bends by 60 degrees."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=8, radius=0.4, depth=4.0)
    obj = bpy.context.active_object
    obj.name = "Bar"
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=6)
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.shape_key_add(name="Basis", from_mix=False)
    bent = obj.shape_key_add(name="Bent", from_mix=False)
    bent.value = 0.0
    for point in bent.points:
        angle = np.radians(60.0) * np.clip(point.co.z / 2.0, 0.0, 1.0)
        height = max(point.co.z, 0.0)
        x, low = point.co.x, min(point.co.z, 0.0)
        point.co.x = x * np.cos(angle) + height * np.sin(angle) * 0.8
        point.co.z = low - x * np.sin(angle) + height * np.cos(angle * 0.8)
    return obj


def bake(tolerance: float) -> None:
    found = bpy.ops.qc3d.bake_inbetweens(
        from_key="Basis", to_key="Bent", use_tolerance=True, tolerance=tolerance, engine='delaunay',
        quality='normal',
    )  # fmt: skip
    assert found == {"FINISHED"}


def positions(obj: bpy.types.Object, name: str) -> np.ndarray:
    key = obj.data.shape_keys.key_blocks[name]
    values = np.empty(3 * len(key.points), dtype=np.float32)
    key.points.foreach_get("co", values)
    return values.reshape(-1, 3)


def steps(obj: bpy.types.Object) -> int:
    return len([key for key in obj.data.shape_keys.key_blocks if key.name.startswith(SLIDER)])


def test_smaller_tolerances_need_more_and_both_are_kept(bar: bpy.types.Object, shapes: ReadShapes) -> None:
    counts = []
    for tolerance in (10.0, 0.05, 0.005):
        bake(tolerance)
        counts.append(steps(bar))
        assert DENSE_STEPS % counts[-1] == 0
    assert counts[0] == 1 < counts[1] < counts[2]
    coarse = shapes(bar)
    # What the fine bake shows is near what one of all steps shows.
    bpy.ops.qc3d.bake_inbetweens(
        from_key="Basis", to_key="Bent", count=DENSE_STEPS - 1, engine="delaunay", quality="normal"
    )
    dense = shapes(bar)
    stride = DENSE_STEPS // counts[2]
    kept = [coarse["Basis"]] + [coarse[f"{SLIDER} {step}/{counts[2]}"] for step in range(1, counts[2] + 1)]
    for step in range(1, DENSE_STEPS):
        before, part = step // stride, step % stride / stride
        blend = kept[before] * (1.0 - part) + kept[min(before + 1, counts[2])] * part
        assert np.linalg.norm(blend - dense[f"{SLIDER} {step}/{DENSE_STEPS}"], axis=1).max() <= 0.005 + 1e-5


def test_a_straight_blend_is_enough(bar: bpy.types.Object, shapes: ReadShapes, shown: Callable[..., Any]) -> None:
    bake(100.0)
    assert [name for name in shapes(bar) if name.startswith(SLIDER)] == [f"{SLIDER} 1/1"]
    seen = shown(bar, **{SLIDER: 0.5})
    assert np.abs(seen - 0.5 * (shapes(bar)["Basis"] + shapes(bar)["Bent"])).max() < 1e-6


def test_baked_again_with_the_same_tolerance(bar: bpy.types.Object) -> None:
    bake(0.02)
    before = steps(bar)
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    assert steps(bar) == before
    for point in bar.data.shape_keys.key_blocks["Bent"].points:
        point.co.z *= 1.0 + 0.5 * max(point.co.x, 0.0)
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    assert steps(bar) > 1
    assert SLIDER in bar


def bend(obj: bpy.types.Object, length: float) -> None:
    """Let the key Lean move vertices by as much as this."""
    for point, rest in zip(obj.data.shape_keys.key_blocks["Lean"].points, obj.data.vertices, strict=True):
        point.co.x = rest.co.x + length * max(rest.co.z, 0.0) ** 2


def remembered(obj: bpy.types.Object) -> Chain:
    """What is remembered of the newest bake."""
    return Record.read(obj.data.shape_keys).chains[-1]


def bake_through(*names: str, **choices: object) -> Chain:
    """Bake between keys of the active object; what is remembered of it."""
    way = {"from_key": names[0], "via": [{"name": name} for name in names[1:-1]], "to_key": names[-1]}
    # Straight ways at a changing speed, which even steps of the slider show the better the more there are.
    smooth = {"mode": "linear", "easing": "ease-in-out"}
    assert bpy.ops.qc3d.bake_inbetweens(**way, **smooth, **choices) == {"FINISHED"}
    chain = Record.read(bpy.context.active_object.data.shape_keys).chain(names)
    assert chain is not None
    return chain


@pytest.mark.usefixtures("quick_map")
def test_no_number_is_enough(figure: bpy.types.Object) -> None:
    chain = bake_through("Basis", "Lean", use_tolerance=True, tolerance=1e-5)
    assert chain.intervals == DENSE_STEPS
    (note,) = [note for note in chain.result.notes if "tolerance" in note]
    assert note.startswith("The most in-betweens that a tolerance makes, 47 between every two keys, miss it: vertices")
    missed = float(note.split("about ")[1].split(" off")[0])
    chain = bake_through("Basis", "Lean", count=2 * DENSE_STEPS - 1)
    frames = np.array([positions(figure, chain.keys[step]) for step in range(1, 2 * DENSE_STEPS)])
    between = frames[2:-1:2] - (frames[1:-2:2] + frames[3::2]) / 2
    assert np.linalg.norm(between, axis=2).max() == pytest.approx(missed, rel=0.2)


@pytest.mark.usefixtures("quick_map")
def test_every_two_keys_of_a_chain_keep_it(figure: bpy.types.Object) -> None:
    keys = ("Lean", "Basis", "Stretch")
    chain = bake_through(*keys, use_tolerance=True, tolerance=0.01)
    assert not [note for note in chain.result.notes if "tolerance" in note]
    found = chain.intervals // 2  # the hardest two keys decide
    assert DENSE_STEPS % found == 0
    assert 1 < found < DENSE_STEPS
    sparse = {step: positions(figure, name) for step, name in chain.keys.items()}
    sparse[found] = positions(figure, "Basis")
    chain = bake_through(*keys, use_tolerance=False, count=DENSE_STEPS - 1)
    dense = {step: positions(figure, name) for step, name in chain.keys.items()}
    dense[DENSE_STEPS] = positions(figure, "Basis")
    stride = DENSE_STEPS // found
    for step, shape in dense.items():
        before, part = step // stride, step % stride / stride
        blend = sparse[before] * (1.0 - part) + sparse[min(before + 1, 2 * found)] * part
        assert np.linalg.norm(blend - shape, axis=1).max() <= 0.01 + 1e-5


@pytest.mark.usefixtures("quick_map")
def test_baked_again_the_keys_stay_unless_more_are_needed(figure: bpy.types.Object) -> None:
    slider = "Basis→Lean"
    chain = bake_through("Basis", "Lean", use_tolerance=True, tolerance=0.01)
    keys = figure.data.shape_keys.key_blocks
    names = keys.keys()
    bend(figure, 0.1)  # which needs fewer
    assert bpy.ops.qc3d.rebake(slider=slider) == {"FINISHED"}
    assert keys.keys() == names
    assert not [note for note in remembered(figure).result.notes if "tolerance" in note]
    bend(figure, 3.0)
    assert bpy.ops.qc3d.rebake(slider=slider) == {"FINISHED"}
    again = remembered(figure)
    assert again.intervals > chain.intervals
    (note,) = [note for note in again.result.notes if "tolerance" in note]
    said = f"The tolerance needs {again.intervals - 1} in-betweens between every two keys now, before it were"
    assert note == f"{said} {chain.intervals - 1}: their shape keys were replaced."
    bend(figure, 0.1)
    few = bake_through("Basis", "Lean", use_tolerance=True, tolerance=0.011)  # another one starts from the fewest
    assert few.intervals < chain.intervals
