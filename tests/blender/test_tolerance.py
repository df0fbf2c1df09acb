# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A tolerance bakes as few in-betweens as it needs, as shape keys."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.store.chain import Chain
from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.settings import DENSE_STEPS

SLIDER = "Basis_to_Bent"
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]

pytestmark = pytest.mark.usefixtures("work_here")


@pytest.fixture
def bar() -> bpy.types.Object:
    """The active object "Bar": a box of height 4 whose upper half bends by 40 degrees."""
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
        angle = np.radians(40.0) * np.clip(point.co.z / 2.0, 0.0, 1.0)
        height = max(point.co.z, 0.0)
        x, low = point.co.x, min(point.co.z, 0.0)
        point.co.x = x * np.cos(angle) + height * np.sin(angle) * 0.8
        point.co.z = low - x * np.sin(angle) + height * np.cos(angle * 0.8)
    return obj


def bake(tolerance: float) -> None:
    found = bpy.ops.qc3d.bake_inbetweens(
        play_on="slider",
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
    for tolerance in (10.0, 0.05, 0.0005):
        bake(tolerance)
        counts.append(steps(bar))
    assert counts[0] == 1 < counts[1] < counts[2] < 13
    (chain,) = Record.read(bar.data.shape_keys).chains
    few, weights = shapes(bar), chain.weights
    # What the few play is near what a bake of all has.
    bpy.ops.qc3d.bake_inbetweens(
        play_on="slider",
        from_key="Basis", to_key="Bent", count=DENSE_STEPS - 1, engine="delaunay", quality="normal"
    )
    dense = shapes(bar)
    kept = np.stack([few[chain.keys.get(step, "Basis")] for step in range(len(chain.places))])
    (chain,) = Record.read(bar.data.shape_keys).chains
    for step, place in enumerate(chain.places):
        played = weights.played(kept, [place])[0]
        assert np.linalg.norm(played - dense[chain.keys.get(step, "Basis")], axis=1).max() <= 0.0005 + 1e-5


def test_a_straight_blend_is_enough(bar: bpy.types.Object, shapes: ReadShapes, shown: Callable[..., Any]) -> None:
    bake(100.0)
    assert [name for name in shapes(bar) if name.startswith(SLIDER)] == [f"{SLIDER}_100"]
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
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", **way, **smooth, **choices) == {"FINISHED"}
    chain = Record.read(bpy.context.active_object.data.shape_keys).chain(names)
    assert chain is not None
    return chain


@pytest.mark.usefixtures("quick_map")
def test_no_number_is_enough(figure: bpy.types.Object) -> None:
    chain = bake_through("Basis", "Lean", use_tolerance=True, tolerance=1e-6, weights="hats")
    assert chain.intervals > 0.9 * DENSE_STEPS


@pytest.mark.usefixtures("quick_map")
def test_a_chain_keeps_it_and_meets_every_key(figure: bpy.types.Object) -> None:
    keys = ("Lean", "Basis", "Stretch")
    chain = bake_through(*keys, use_tolerance=True, tolerance=0.01)
    assert not [note for note in chain.result.notes if "tolerance" in note]
    assert 0.5 in chain.places
    assert chain.corners == (chain.places.index(0.5),)  # which the mode linear turns at
    shown = np.stack([positions(figure, chain.keys.get(step, "Basis")) for step in range(len(chain.places))])
    weights = chain.weights
    chain = bake_through(*keys, use_tolerance=False, count=DENSE_STEPS - 1)
    for step, place in enumerate(chain.places):
        shape = positions(figure, chain.keys.get(step, "Basis"))
        assert np.linalg.norm(weights.played(shown, [place])[0] - shape, axis=1).max() <= 0.01 + 1e-5


@pytest.mark.usefixtures("quick_map")
def test_baked_again_the_keys_stay_and_more_come_where_they_are_needed(figure: bpy.types.Object) -> None:
    slider = "Basis_to_Lean"
    chain = bake_through("Basis", "Lean", use_tolerance=True, tolerance=0.01, weights="hats")
    keys = figure.data.shape_keys.key_blocks
    names = keys.keys()
    bend(figure, 0.1)  # which needs fewer
    assert bpy.ops.qc3d.rebake(slider=slider) == {"FINISHED"}
    assert keys.keys() == names
    bend(figure, 3.0)
    assert bpy.ops.qc3d.rebake(slider=slider) == {"FINISHED"}
    again = remembered(figure)
    assert again.intervals > chain.intervals
    assert keys.keys()[: len(names)] == names
    bend(figure, 0.1)
    # Another tolerance starts from the fewest.
    few = bake_through("Basis", "Lean", use_tolerance=True, tolerance=0.011, weights="hats")
    assert few.intervals < chain.intervals
