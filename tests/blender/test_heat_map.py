# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The heat map: attributes that follow the slider, and nothing left behind when it is hidden."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.heat_map import heat_map
from qc3d_addon.blender.heat_map.colors import linear, scale_of
from qc3d_addon.blender.store import kept_measures

pytestmark = pytest.mark.usefixtures("quick_map")

SLIDER = "Basis_to_Lean"
Shown = Callable[..., np.ndarray]


@pytest.fixture
def baked(figure: bpy.types.Object) -> bpy.types.Object:
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key="Lean", mode="linear", count=3
    ) == {"FINISHED"}
    return figure


def at_vertices(mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    values = np.empty(len(mesh.vertices), dtype=np.float32)
    mesh.attributes[name].data.foreach_get("value", values)
    return values


def evaluated(obj: bpy.types.Object, **sliders: float) -> bpy.types.Mesh:
    for name, value in sliders.items():
        obj[name] = value
    obj.update_tag()
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def edge_ratios(shape: np.ndarray, rest: np.ndarray, mesh: bpy.types.Mesh) -> np.ndarray:
    ends = np.array([edge.vertices[:] for edge in mesh.edges])
    before, after = (np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1) for points in (rest, shape))
    return after / before


def test_a_bake_keeps_measures_and_nothing_that_is_seen(baked: bpy.types.Object) -> None:
    assert not [a.name for a in baked.data.attributes if "QC3D" in a.name]
    assert not baked.modifiers
    measures = kept_measures.read(baked.data.shape_keys, SLIDER, len(baked.data.vertices))
    assert measures is not None
    assert {values.shape for values in measures.values()} == {(5, len(baked.data.vertices))}
    assert np.abs(measures["stretch"][0] - 1.0).max() < 1e-3
    assert measures["stretch"][4].max() > 1.1


@pytest.mark.parametrize("measure", kept_measures.MEASURES)
def test_the_attributes_follow_the_slider(baked: bpy.types.Object, measure: str) -> None:
    assert bpy.ops.qc3d.heat_map(measure=measure) == {"FINISHED"}
    steps = [at_vertices(baked.data, f"QC3D {measure} {step}") for step in range(5)]
    for place in (0.0, 0.25, 0.4, 0.75, 1.0, 2.0, -1.0):
        seen = evaluated(baked, **{SLIDER: place})
        along = 4.0 * min(max(place, 0.0), 1.0)
        before, part = min(int(along), 3), along - min(int(along), 3)
        expected = (1.0 - part) * steps[before] + part * steps[before + 1]
        np.testing.assert_allclose(at_vertices(seen, f"QC3D {measure}"), expected, rtol=1e-5)
        assert seen.color_attributes.active_color_name == heat_map.NAME


def test_the_colors_are_those_of_the_scale(baked: bpy.types.Object) -> None:
    bpy.ops.qc3d.heat_map(measure="stretch")
    state = heat_map.shown(baked)
    assert state is not None
    seen = evaluated(baked, **{SLIDER: 1.0})
    values = at_vertices(seen, "QC3D stretch")
    colors = np.empty(4 * len(values), dtype=np.float32)
    seen.attributes[heat_map.NAME].data.foreach_get("color", colors)
    place = np.log(values / state.scale.low) / np.log(state.scale.high / state.scale.low)
    stops = np.linspace(0.0, 1.0, len(state.scale.colors))
    for channel in range(3):
        known = [linear(color)[channel] for color in state.scale.colors]
        expected = np.interp(place, stops, known)
        np.testing.assert_allclose(colors.reshape(-1, 4)[:, channel], expected, atol=2e-3)


def test_another_measure_is_shown_as_soon_as_it_is_chosen(baked: bpy.types.Object) -> None:
    baked.qc3d.measure = "volume"
    assert heat_map.shown(baked) is None  # choosing alone shows nothing
    bpy.ops.qc3d.heat_map(measure="volume")
    for measure in ("dilatation", "stretch"):
        baked.qc3d.measure = measure
        state = heat_map.shown(baked)
        assert state is not None
        assert state.measure == measure
    kept_measures.forget(baked.data.shape_keys, SLIDER, ExitStack())
    baked.qc3d.measure = "volume"  # which is not known any more
    assert heat_map.shown(baked).measure == "stretch"


def test_hidden_again_nothing_is_left(baked: bpy.types.Object, state: Callable[[], dict[str, Any]]) -> None:
    own = baked.data.color_attributes.new("Mine", "FLOAT_COLOR", "POINT")
    baked.data.color_attributes.active_color_name = own.name
    baked.data.attributes.new("QC3D mine", "FLOAT", "POINT")
    before, names = state(), {attribute.name for attribute in baked.data.attributes}
    for measure in ("stretch", "volume", "volume"):
        bpy.ops.qc3d.heat_map(measure=measure)
    assert heat_map.shown(baked) is None
    assert state() == before
    assert {attribute.name for attribute in baked.data.attributes} == names
    assert baked.data.color_attributes.active_color_name == "Mine"
    assert not baked.modifiers
    assert not bpy.data.node_groups
    bpy.ops.qc3d.heat_map(measure="dilatation", show="on")
    assert bpy.ops.qc3d.heat_map(measure="stretch", show="off") == {"FINISHED"}
    assert heat_map.shown(baked) is None


def test_a_new_bake_refreshes_it(baked: bpy.types.Object) -> None:
    bpy.ops.qc3d.heat_map(measure="stretch")
    before = at_vertices(baked.data, "QC3D stretch 4")
    for point in baked.data.shape_keys.key_blocks["Lean"].points:
        point.co.z *= 1.5
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}
    assert at_vertices(baked.data, "QC3D stretch 4").max() > 1.1 * before.max()
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", mode="linear", count=1)
    assert "QC3D stretch 2" in baked.data.attributes
    assert "QC3D stretch 3" not in baked.data.attributes
    # In-betweens of other keys are none of its business.
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Stretch", mode="linear", count=3)
    state = heat_map.shown(baked)
    assert state is not None
    assert state.slider == SLIDER


def test_it_is_saved_and_works_without_the_add_on(baked: bpy.types.Object, tmp_path: Path) -> None:
    import qc3d_addon

    bpy.ops.qc3d.heat_map(measure="stretch")
    expected = at_vertices(evaluated(baked, **{SLIDER: 0.6}), "QC3D stretch")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    qc3d_addon.unregister()
    try:
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
        seen = evaluated(bpy.data.objects["Figure"], **{SLIDER: 0.6})
        np.testing.assert_array_equal(at_vertices(seen, "QC3D stretch"), expected)
    finally:
        qc3d_addon.register()


def test_in_betweens_that_were_not_measured(baked: bpy.types.Object, state: Callable[[], dict[str, Any]]) -> None:
    kept_measures.forget(baked.data.shape_keys, SLIDER, ExitStack())
    before = state()
    with pytest.raises(RuntimeError, match="were not measured on this mesh; re-bake them first"):
        bpy.ops.qc3d.heat_map(measure="stretch")
    assert state() == before


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: b"QCM0" + data[4:],
        lambda data: data[:40],
        lambda data: data[:12] + bytes(len(data) - 12),
        lambda data: data[:4] + (2**31).to_bytes(4, "little") + data[8:],
        lambda data: data[:8] + (2**31).to_bytes(4, "little") + data[12:],
    ],
)
def test_damaged_measures_are_none(baked: bpy.types.Object, damage: Callable[[bytes], bytes]) -> None:
    keys = baked.data.shape_keys
    name = next(name for name in keys.keys() if "measures" in name)  # noqa: SIM118
    data = keys.pop(name)
    keys[name] = damage(data)
    assert kept_measures.read(keys, SLIDER, len(baked.data.vertices)) is None
    del keys[name]
    keys[name] = data
    assert kept_measures.read(keys, SLIDER, len(baked.data.vertices)) is not None
    assert kept_measures.read(keys, SLIDER, 3) is None


def test_the_scale_holds_nearly_all_values() -> None:
    values = np.ones((3, 1000), dtype=np.float32)
    assert scale_of("stretch", values).ticks == [(0.0, "0.98"), (0.5, "1"), (1.0, "1.02")]
    values[1, :500] = 0.6
    values[2, 0] = 50.0  # one vertex does not make the rest gray
    assert scale_of("volume", values)[1:3] == (0.5, 2.0)
    values[1, :500] = 2.9
    assert scale_of("dilatation", values).ticks == [(0.0, "1"), (0.5, "1.73"), (1.0, "3")]


class TestWorstPlace:
    def test_slider_selection_and_cursor_go_there(self, baked: bpy.types.Object, shown: Shown) -> None:
        mesh = baked.data
        baked.location = (1.0, 2.0, 3.0)
        assert bpy.ops.qc3d.select_worst() == {"FINISHED"}
        place = baked[SLIDER]
        assert place in (0.25, 0.5, 0.75)
        selected = {vertex.index for vertex in mesh.vertices if vertex.select}
        middle = [
            v for v in selected if selected == {v} | {o for e in mesh.edges if v in e.vertices for o in e.vertices}
        ]
        assert len(middle) == 1
        where = shown(baked)[middle[0]] + np.array([1.0, 2.0, 3.0])
        np.testing.assert_allclose(bpy.context.scene.cursor.location, where, atol=1e-5)
        assert baked.active_shape_key.name == f"{SLIDER}_{25 * round(4 * place)}"
        # The worst edge there is as bad as the panel says.
        keys = {key.name: key for key in mesh.shape_keys.key_blocks}
        shapes = {}
        for name in ("Basis", "Lean", baked.active_shape_key.name):
            values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
            keys[name].points.foreach_get("co", values)
            shapes[name] = values.reshape(-1, 3).astype(np.float64)
        ratio = edge_ratios(shapes[baked.active_shape_key.name], shapes["Basis"], mesh)
        key = edge_ratios(shapes["Lean"], shapes["Basis"], mesh)
        excess = np.maximum(ratio / np.maximum(key, 1.0), np.minimum(key, 1.0) / ratio) - 1.0
        from qc3d_addon.blender.store.records import Record

        stored = Record.read(mesh.shape_keys).chains[0].result.worst
        assert stored.excess == pytest.approx(excess.max(), rel=0.05)

    def test_a_mesh_that_lost_the_vertex(self, baked: bpy.types.Object) -> None:
        from qc3d_addon.blender.store.records import Record

        record = Record.read(baked.data.shape_keys)
        result = record.chains[0].result
        record.chains[0].result = replace(result, worst=replace(result.worst, vertex=10**6))
        record.write(baked.data.shape_keys, ExitStack())
        with pytest.raises(RuntimeError, match="not measured on this mesh"):
            bpy.ops.qc3d.select_worst()

    def test_no_in_betweens(self, figure: bpy.types.Object) -> None:
        for operator in (bpy.ops.qc3d.select_worst, bpy.ops.qc3d.heat_map):
            assert not operator.poll()
            with pytest.raises(RuntimeError, match="no in-betweens yet; bake some first"):
                operator()
