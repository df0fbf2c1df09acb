# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking: the keys that it makes, the slider that plays them, and everything that it must not touch."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import bpy
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from qc3d_addon.solver.settings import Mode

Shapes = dict[str, np.ndarray]
ReadShapes = Callable[[bpy.types.Object], Shapes]
Shown = Callable[..., np.ndarray]

NAMES = ["Basis_to_Lean_25", "Basis_to_Lean_50", "Basis_to_Lean_75", "Basis_to_Lean_100"]


def bake(from_key: str = "Basis", to_key: str = "Lean", mode: str = 'linear', **choices: object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key=from_key, to_key=to_key, mode=mode, **choices
    ) == {'FINISHED'}


def displayed(basis: np.ndarray, key: np.ndarray) -> np.ndarray:
    """What Blender shows where one key is fully on, in its own arithmetic: basis - 1 * (basis - key), in float32."""
    return basis - (basis - key)


@pytest.mark.parametrize("mode", get_args(Mode))
def test_the_real_solver_bakes_between_two_keys(
    figure: bpy.types.Object, shapes: ReadShapes, shown: Shown, mode: str
) -> None:
    bake(quality='normal', engine='delaunay', mode=mode, count=3)
    got = shapes(figure)
    assert [name for name in got if "_to_" in name] == NAMES
    assert np.array_equal(got["Basis_to_Lean_100"], got["Lean"])
    still = (got["Basis"] == got["Lean"]).all(axis=1)
    assert 0 < still.sum() < len(still)
    for name in NAMES:
        assert np.array_equal(got[name][still], got["Basis"][still])
    # Not the straight blend, unless asked for, and not far from it: the figure leans smoothly.
    for step, name in enumerate(NAMES[:3], start=1):
        blend = got["Basis"] + step / 4 * (got["Lean"] - got["Basis"])
        assert (0.0 if mode == "straight" else 1e-6) <= np.abs(got[name] - blend).max() < 0.05
    assert np.array_equal(shown(figure, Basis_to_Lean=0.5), displayed(got["Basis"], got["Basis_to_Lean_50"]))


@pytest.mark.usefixtures("quick_map")
class TestKeys:
    def test_the_keys_hold_the_in_betweens_and_the_second_key(
        self, figure: bpy.types.Object, shapes: ReadShapes
    ) -> None:
        bake(count=3)
        got = shapes(figure)
        assert list(got) == ["Basis", "Lean", "Stretch", *NAMES]
        for step in (1, 2, 3):
            blend = got["Basis"] + step / 4 * (got["Lean"] - got["Basis"])
            assert np.abs(got[NAMES[step - 1]] - blend).max() < 1e-6
        assert np.array_equal(got[NAMES[3]], got["Lean"])

    def test_new_keys_are_off_at_first_and_relative_to_the_basis(self, figure: bpy.types.Object) -> None:
        bake(count=3)
        keys = figure.data.shape_keys
        for name in NAMES:
            assert keys.key_blocks[name].value == 0.0
            assert keys.key_blocks[name].relative_key == keys.reference_key
            assert keys.key_blocks[name].slider_min < 0.0  # as smooth weights are

    def test_the_animators_own_keys_stay_as_they_are(
        self, figure: bpy.types.Object, state: Callable[[], dict[str, Any]]
    ) -> None:
        keys = figure.data.shape_keys
        keys.key_blocks["Stretch"].value = 0.25
        keys.key_blocks["Lean"].value = 0.125
        keys.key_blocks["Stretch"].relative_key = keys.key_blocks["Lean"]
        curve = keys.driver_add('key_blocks["Lean"].value')
        curve.driver.expression = "0.125"
        figure.active_shape_key_index = 2
        before = state()
        bake()
        after = state()
        assert after["keys"]["Key"]["blocks"][:3] == before["keys"]["Key"]["blocks"]
        assert ('key_blocks["Lean"].value', "0.125") in after["keys"]["Key"]["drivers"]
        assert after["objects"]["Figure"]["active key"] == 2
        assert after["meshes"] == before["meshes"]

    def test_two_pairs_live_beside_each_other(self, figure: bpy.types.Object, shapes: ReadShapes) -> None:
        bake(count=1)
        first = shapes(figure)
        bake("Basis", "Stretch", count=2)
        both = shapes(figure)
        assert list(both) == [
            *first,
            "Basis_to_Stretch_33",
            "Basis_to_Stretch_67",
            "Basis_to_Stretch_100",
        ]
        assert all(np.array_equal(both[name], first[name]) for name in first)
        assert {"Basis_to_Lean", "Basis_to_Stretch"} <= set(figure.keys())

    def test_a_name_that_the_animator_uses_already_is_left_to_them(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        own = figure.shape_key_add(name="Basis_to_Lean_50", from_mix=False)
        own.value = 0.0
        bake(count=1)
        bake(count=1)
        got = shapes(figure)
        made = [name for name in got if "_to_" in name]
        assert made == ["Basis_to_Lean_50", "Basis_to_Lean_50.001", "Basis_to_Lean_100"]
        assert np.array_equal(got["Basis_to_Lean_50"], got["Basis"])
        assert np.array_equal(
            shown(figure, Basis_to_Lean=0.5), displayed(got["Basis"], got["Basis_to_Lean_50.001"])
        )

    def test_a_property_with_the_sliders_name_is_left_alone(self, figure: bpy.types.Object) -> None:
        figure["Basis_to_Lean"] = "a note"
        bake(count=1)
        assert figure["Basis_to_Lean"] == "a note"
        assert figure["Basis_to_Lean_v2"] == 0.0

    def test_names_with_quotes_and_backslashes_work(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        name = 'say "ah"\\[0]'
        figure.data.shape_keys.key_blocks["Lean"].name = name
        bake(to_key=name, count=1)
        got = shapes(figure)
        assert np.array_equal(
            shown(figure, **{f"Basis_to_{name}": 1.0}), displayed(got["Basis"], got[f"Basis_to_{name}_100"])
        )

    def test_long_names_stay_apart(self, figure: bpy.types.Object, shown: Shown, shapes: ReadShapes) -> None:
        names = [f"{'Mouth' * 6}{which}{'Corner' * 5}" for which in "LR"]
        for key, name in zip(list(figure.data.shape_keys.key_blocks)[1:], names, strict=True):
            key.name = name
        for name in names:
            bake(to_key=name, count=1)
        got = shapes(figure)
        made = [name for name in got if "_to_" in name]
        assert len(made) == 4
        assert [name.rsplit("_", 1)[1] for name in made] == ["50", "100"] * 2
        for slider, key, ours in zip(
            [name for name, _ in figure.items() if "_to_" in name], names, (made[1], made[3]), strict=True
        ):
            assert np.array_equal(got[ours], got[key])
            assert np.array_equal(shown(figure, **{slider: 1.0}), displayed(got["Basis"], got[key]))
            figure[slider] = 0.0

    def test_wire_edges_and_large_faces_are_read(self, quick_map: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
        from qc3d_addon.solver.keys.keypair import KeyPair

        pairs = []
        checked = KeyPair.checked
        monkeypatch.setattr(KeyPair, "checked", lambda *arrays: pairs.append(checked(*arrays)) or pairs[-1])
        mesh = bpy.data.meshes.new("Kite")
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (0, 0, 2)]
        mesh.from_pydata(corners, [(4, 5), (0, 4)], [(0, 1, 2, 3)])
        obj = bpy.data.objects.new("Kite", mesh)
        bpy.context.scene.collection.objects.link(obj)
        bpy.context.view_layer.objects.active = obj
        obj.shape_key_add(name="Basis")
        obj.shape_key_add(name="Up", from_mix=False).points[5].co.z = 3.0
        bake(to_key="Up", count=1)
        assert sorted(map(sorted, pairs[0].edges.tolist())) == [[0, 4], [4, 5]]
        assert pairs[0].faces.shape == (2, 3)
        assert set(pairs[0].faces.ravel()) == {0, 1, 2, 3}


@pytest.mark.usefixtures("quick_map")
class TestSlider:
    @pytest.mark.parametrize("count", [1, 3, 7])
    def test_each_in_between_shows_exactly_at_its_place(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown, count: int
    ) -> None:
        bake(count=count)  # counts whose places are exact in binary
        got = shapes(figure)
        intervals = count + 1
        for step in range(1, intervals + 1):
            at = shown(figure, Basis_to_Lean=step / intervals)
            assert np.array_equal(at, displayed(got["Basis"], got[f"Basis_to_Lean_{100 * step / intervals:02.0f}"]))
        assert np.array_equal(shown(figure, Basis_to_Lean=0.0), got["Basis"])

    def test_thirds_show_to_the_last_bits(self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown) -> None:
        bake(count=2)
        got = shapes(figure)
        at = shown(figure, Basis_to_Lean=1 / 3)
        assert np.abs(at - got["Basis_to_Lean_33"]).max() < 1e-6

    def test_with_hats_two_in_betweens_blend(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        bake(count=3, weights="hats")
        got = shapes(figure)
        at = shown(figure, Basis_to_Lean=0.375)
        assert np.abs(at - (got[NAMES[0]] + got[NAMES[1]]) / 2).max() < 1e-6

    def test_a_smooth_path_goes_through_them_and_on_beyond_the_keys(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        bake(count=3, easing="ease-in-out")
        got = shapes(figure)
        knots = np.stack([got["Basis"], *(got[name] for name in NAMES)])
        path = CubicSpline(np.linspace(0.0, 1.0, 5), knots)
        for place in (0.1, 0.3, 0.62, 0.97):
            assert np.abs(shown(figure, Basis_to_Lean=place) - path(place)).max() < 2e-6
        for place, end in ((-0.2, 0.0), (1.3, 1.0)):
            beyond = path(end) + (place - end) * path(end, 1)
            assert np.abs(shown(figure, Basis_to_Lean=place) - beyond).max() < 1e-5

    def test_baked_again_with_other_weights_the_same_keys_play_otherwise(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        bake(count=3, weights="hats", easing="ease-in-out")
        before = shapes(figure)
        hats = shown(figure, Basis_to_Lean=0.3)
        bake(count=3, easing="ease-in-out")
        assert list(shapes(figure)) == list(before)
        assert np.abs(shown(figure, Basis_to_Lean=0.3) - hats).max() > 1e-3
        bake(count=3, weights="hats", easing="ease-in-out")
        assert np.abs(shown(figure, Basis_to_Lean=0.3) - hats).max() < 1e-6

    def test_vertices_that_both_keys_leave_in_place_never_move(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        bake(count=4)
        got = shapes(figure)
        still = (got["Basis"] == got["Lean"]).all(axis=1)
        for value in np.linspace(0.0, 1.0, 12):
            at = shown(figure, Basis_to_Lean=float(value))
            assert np.array_equal(at[still], got["Basis"][still])

    def test_nothing_changes_to_the_eye_at_first_where_a_key_is_the_basis(
        self, figure: bpy.types.Object, shown: Shown, shapes: ReadShapes
    ) -> None:
        before = shown(figure)
        bake("Basis", "Lean", count=1)
        bake("Stretch", "Basis", count=1)
        assert (figure["Basis_to_Lean"], figure["Stretch_to_Basis"]) == (0.0, 1.0)
        assert np.array_equal(shown(figure), before)
        got = shapes(figure)
        at = shown(figure, Stretch_to_Basis=0.0)
        assert np.array_equal(at, displayed(got["Basis"], got["Stretch"]))

    def test_between_two_other_keys_it_goes_from_the_first_to_the_second(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        bake("Lean", "Stretch", count=1)
        got = shapes(figure)
        assert list(got)[3:] == ["Lean_to_Stretch_00", "Lean_to_Stretch_50", "Lean_to_Stretch_100"]
        assert np.array_equal(got["Lean_to_Stretch_00"], got["Lean"])
        for value, name in ((0.0, "Lean"), (0.5, "Lean_to_Stretch_50"), (1.0, "Stretch")):
            at = shown(figure, Lean_to_Stretch=value)
            assert np.array_equal(at, displayed(got["Basis"], got[name]))

    def test_it_goes_from_0_to_1_and_can_be_animated_where_the_figure_is_linked(
        self, figure: bpy.types.Object
    ) -> None:
        bake()
        ui = figure.id_properties_ui("Basis_to_Lean").as_dict()
        assert (ui["min"], ui["max"], ui["soft_min"], ui["soft_max"]) == (-1.0, 2.0, 0.0, 1.0)
        assert figure.is_property_overridable_library('["Basis_to_Lean"]')

    def test_its_drivers_need_no_permission_to_run_scripts(
        self, figure: bpy.types.Object, slider_drivers: Callable[..., dict[str, bpy.types.Driver]]
    ) -> None:
        bake(count=3)
        drivers = slider_drivers(figure, "Basis_to_Lean")
        assert len(drivers) == 4
        assert all(driver.type == 'AVERAGE' and driver.is_valid for driver in drivers.values())

    def test_a_key_that_is_on_by_itself_is_pointed_out(self, figure: bpy.types.Object) -> None:
        from qc3d_addon.blender.bake.request import BakeRequest
        from qc3d_addon.blender.bake.run import bake_object

        figure.data.shape_keys.key_blocks["Lean"].value = 0.5
        result = bake_object(figure, BakeRequest(("Basis", "Lean"), 1, play_on="slider"))
        assert any("'Lean' has the value 0.50" in note for note in result.notes)


@pytest.mark.usefixtures("quick_map")
def test_what_the_caller_leaves_out_comes_from_the_panel(figure: bpy.types.Object, quick_map: list[Any]) -> None:
    figure.qc3d.from_key, figure.qc3d.to_key = "Lean", "Stretch"
    figure.qc3d.count, figure.qc3d.quality, figure.qc3d.engine = 2, 'finest', 'delaunay'
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider") == {'FINISHED'}
    assert "Lean_to_Stretch_33" in figure.data.shape_keys.key_blocks
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", count=1, quality='normal')
    assert "Lean_to_Stretch_50" in figure.data.shape_keys.key_blocks
    assert [(call.quality, call.engine) for call in quick_map] == [('finest', 'delaunay'), ('normal', 'delaunay')]


@pytest.mark.usefixtures("quick_map")
def test_the_baked_file_plays_without_the_add_on(
    figure: bpy.types.Object, shapes: ReadShapes, shown: Shown, tmp_path: Path
) -> None:
    import qc3d_addon

    bake(count=1)
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    qc3d_addon.unregister()
    try:
        bpy.ops.wm.open_mainfile(filepath=path)
        loaded = bpy.data.objects["Figure"]
        got = shapes(loaded)
        at = shown(loaded, Basis_to_Lean=0.5)
        assert np.array_equal(at, displayed(got["Basis"], got["Basis_to_Lean_50"]))
    finally:
        qc3d_addon.register()
