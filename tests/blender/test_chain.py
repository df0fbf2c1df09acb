# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains: one slider meets every key, and only pairs that changed are fitted again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any, get_args

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.bake.request import BakeRequest
from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.easing import eased
from qc3d_addon.solver.settings import Easing, FitOptions, FrameOptions

Shapes = dict[str, np.ndarray]
ReadShapes = Callable[[bpy.types.Object], Shapes]
Shown = Callable[..., np.ndarray]
State = Callable[[], dict[str, Any]]

CHAIN = "Basis_to_Lean_to_Stretch"


def bake(*names: str, **choices: object) -> None:
    first, *inner, last = names or ("Basis", "Lean", "Stretch")
    via = [{"name": name} for name in inner]
    choices = {"mode": 'linear', "count": 1, **choices}
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key=first, via=via, to_key=last, **choices
    ) == {'FINISHED'}


def made(shapes: Shapes) -> list[str]:
    return [name for name in shapes if "_to_" in name]


def displayed(basis: np.ndarray, key: np.ndarray) -> np.ndarray:
    """What Blender shows where one key is fully on, in its own arithmetic."""
    return basis - (basis - key)


def test_the_real_solver_meets_every_key_without_a_corner_at_the_inner_one(
    figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
) -> None:
    choices = {"mode": 'natural', "quality": 'normal', "engine": 'delaunay', "count": 3}
    bake(**choices)
    got = shapes(figure)
    assert made(got) == [f"{CHAIN}_{100 * step / 8:02.0f}" for step in range(1, 9)]
    for value, name in ((0.0, "Basis"), (0.5, "Lean"), (1.0, "Stretch")):
        assert np.array_equal(shown(figure, **{CHAIN: value}), displayed(got["Basis"], got[name]))
    bake("Basis", "Lean", **choices)
    bake("Lean", "Stretch", **choices)
    got = shapes(figure)

    def corner(before: str, after: str) -> float:
        """How much the step after the inner key differs from the one before."""
        return float(np.abs(got[before] + got[after] - 2.0 * got["Lean"]).max())

    assert corner(f"{CHAIN}_38", f"{CHAIN}_62") < 0.7 * corner("Basis_to_Lean_75", "Lean_to_Stretch_25")


@pytest.mark.usefixtures("quick_map")
class TestKeys:
    def test_inner_keys_are_copied_like_the_ends(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        bake("Lean", "Stretch", "Lean", count=1)
        got = shapes(figure)
        assert made(got) == [f"Lean_to_Stretch_to_Lean_{25 * step:02}" for step in range(5)]
        for step, name in ((0, "Lean"), (2, "Stretch"), (4, "Lean")):
            assert np.array_equal(got[f"Lean_to_Stretch_to_Lean_{25 * step:02}"], got[name])
            at = shown(figure, Lean_to_Stretch_to_Lean=step / 4)
            assert np.array_equal(at, displayed(got["Basis"], got[name]))

    def test_the_basis_on_the_way_needs_no_copy_and_the_slider_starts_there(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        before = shown(figure)
        bake("Lean", "Basis", "Stretch")
        got = shapes(figure)
        assert made(got) == [f"Lean_to_Basis_to_Stretch_{25 * step:02}" for step in (0, 1, 3, 4)]
        assert figure["Lean_to_Basis_to_Stretch"] == 0.5
        assert np.array_equal(shown(figure), before)

    def test_a_chain_and_its_pairs_live_beside_each_other(
        self, figure: bpy.types.Object, shapes: ReadShapes, quick_map: list[FitOptions]
    ) -> None:
        bake("Basis", "Lean")
        pair = shapes(figure)
        bake()
        bake("Lean", "Stretch")
        both = shapes(figure)
        assert all(np.array_equal(both[name], shape) for name, shape in pair.items())
        assert {"Basis_to_Lean", CHAIN, "Lean_to_Stretch"} <= set(figure.keys())
        assert len(quick_map) == 2  # a map for each of the two pairs, whatever it was made for

    def test_a_name_with_an_arrow_is_not_taken_for_a_chain(self, figure: bpy.types.Object) -> None:
        figure.shape_key_add(name="Lean_to_Stretch", from_mix=False).points[0].co.x += 0.5
        bake("Basis", "Lean_to_Stretch")
        bake()
        assert {CHAIN, f"{CHAIN}_v2"} <= set(figure.keys())


class TestBakingAgain:
    def test_the_same_bake_again_changes_nothing(
        self, figure: bpy.types.Object, quick_map: list[FitOptions], state: State
    ) -> None:
        bake(use_keyframes=True)
        before = state()
        bake(use_keyframes=True)
        assert state() == before
        assert len(quick_map) == 2

    def test_only_pairs_with_a_changed_key_are_prepared_again(
        self, figure: bpy.types.Object, quick_map: list[FitOptions], shapes: ReadShapes
    ) -> None:
        bake()
        figure.data.shape_keys.key_blocks["Stretch"].points[0].co.x += 0.5
        bake()
        assert len(quick_map) == 3
        got = shapes(figure)
        assert np.array_equal(got[f"{CHAIN}_100"], got["Stretch"])
        figure.data.shape_keys.key_blocks["Lean"].points[0].co.x += 0.5
        bake()
        assert len(quick_map) == 5

    def test_another_number_of_in_betweens_replaces_the_keys(
        self, figure: bpy.types.Object, quick_map: list[FitOptions], shapes: ReadShapes
    ) -> None:
        bake(count=2)
        bake("Basis", "Lean")
        bake(count=1)
        assert made(shapes(figure)) == [
            *(f"{CHAIN}_{place}" for place in (50, 100)),  # where there were some before
            "Basis_to_Lean_50",
            "Basis_to_Lean_100",
            *(f"{CHAIN}_{place}" for place in (25, 75)),
        ]
        assert len(quick_map) == 2

    def test_prepare_makes_every_map_of_the_chain(self, figure: bpy.types.Object, quick_map: list[FitOptions]) -> None:
        keys = {"from_key": "Basis", "via": [{"name": "Lean"}], "to_key": "Stretch"}
        assert bpy.ops.qc3d.prepare(**keys) == {'FINISHED'}
        bake()
        assert len(quick_map) == 2


@pytest.mark.usefixtures("quick_map")
class TestEasing:
    @pytest.mark.parametrize("easing", get_args(Easing))
    def test_shapes_are_eased_and_keys_stay_even_on_the_slider(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown, easing: str
    ) -> None:
        bake("Basis", "Lean", count=3, easing=easing)
        got = shapes(figure)
        for step, part in enumerate(eased(np.linspace(0.0, 1.0, 5), easing)):
            blend = got["Basis"] + part * (got["Lean"] - got["Basis"])
            assert np.abs(shown(figure, Basis_to_Lean=step / 4) - blend).max() < 1e-6

    def test_another_easing_moves_the_inner_key(
        self, figure: bpy.types.Object, shapes: ReadShapes, quick_map: list[FitOptions]
    ) -> None:
        bake(easing='linear')
        before = shapes(figure)
        bake(easing='ease-in')
        after = shapes(figure)
        np.testing.assert_array_equal(after[f"{CHAIN}_71"], before[f"{CHAIN}_50"])  # half way is where the root is
        assert len(after) == len(before)
        assert len(quick_map) == 2

    def test_every_key_is_met_whatever_the_easing(
        self, figure: bpy.types.Object, shapes: ReadShapes, shown: Shown
    ) -> None:
        for easing in get_args(Easing):
            bake(count=2, easing=easing)
            place = {"ease-in": 0.5**0.5, "ease-out": 1.0 - 0.5**0.5}.get(easing, 0.5)
            assert np.abs(shown(figure, **{CHAIN: place}) - shapes(figure)["Lean"]).max() < 1e-6


@pytest.mark.usefixtures("quick_map")
class TestPanel:
    def test_rows_of_keys_are_added_and_removed(self, figure: bpy.types.Object, shapes: ReadShapes) -> None:
        settings = figure.qc3d
        settings.from_key, settings.to_key, settings.count = "Basis", "Stretch", 1
        bpy.ops.qc3d.add_inner_key()
        bpy.ops.qc3d.add_inner_key()
        settings.via[1].name = "Lean"
        with pytest.raises(RuntimeError, match="Choose inner key 1"):
            bpy.ops.qc3d.bake_inbetweens(play_on="slider")
        bpy.ops.qc3d.remove_inner_key(index=0)
        assert bpy.ops.qc3d.bake_inbetweens(play_on="slider") == {'FINISHED'}
        assert CHAIN in figure
        with pytest.raises(RuntimeError, match="There is no row 1"):
            bpy.ops.qc3d.remove_inner_key(index=1)

    def test_who_names_the_ends_means_the_keys_between_as_given(self, figure: bpy.types.Object) -> None:
        figure.qc3d.via.add().name = "Lean"
        assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Stretch") == {'FINISHED'}
        assert "Basis_to_Stretch" in figure

    def test_every_setting_reaches_the_solver(self, figure: bpy.types.Object, quick_map: list[FitOptions]) -> None:
        chosen = FitOptions("delaunay", "finest", 7, "logarithmic", 2)
        frames = FrameOptions("linear", "ease-out")
        for name, value in {**asdict(chosen), **asdict(frames)}.items():
            if name != "mesh_time_limit":
                setattr(figure.qc3d, name, value)
        figure.qc3d.from_key, figure.qc3d.to_key = "Basis", "Lean"
        bpy.ops.qc3d.bake_inbetweens(play_on="slider")
        bpy.ops.qc3d.prepare()
        assert quick_map == [chosen, chosen]
        remembered = Record.read(figure.data.shape_keys).chains[0].request["settings"]
        assert {**remembered, "via_at": ()} == {**asdict(chosen), **asdict(frames)}

    def test_it_draws_a_row_for_each_key_and_only_what_is_there(self, figure: bpy.types.Object) -> None:
        from qc3d_addon.blender.ui.panels import QC3D_PT_inbetweens

        figure.qc3d.from_key, figure.qc3d.to_key = "Basis", "Stretch"
        figure.qc3d.via.add().name = "Lean"
        drawn: list[str] = []

        class Layout:
            """Stands in for Blender's, which only a window has: takes note of the properties and operators."""

            def prop(self, data: object, name: str, **options: object) -> None:
                assert hasattr(data, name)
                drawn.append(name)

            def prop_search(self, data: object, name: str, source: object, names: str, **options: object) -> None:
                chosen = getattr(data, name)
                assert chosen in getattr(source, names) or (chosen, name) == ("", "colliders")
                drawn.append(getattr(data, name))

            def operator(self, name: str, **options: object) -> Layout:
                assert hasattr(bpy.ops.qc3d, name.removeprefix("qc3d."))
                return self

            def panel(self, name: str, default_closed: bool) -> tuple[Layout, Layout]:
                assert default_closed
                return self, self

            def menu(self, name: str, **options: object) -> None:
                assert hasattr(bpy.types, name)

            def label(self, text: str, **options: object) -> None:
                drawn.append(text)

            def row(self, **options: object) -> Layout:
                return self

            column = row

        class Panel:
            layout = Layout()

        QC3D_PT_inbetweens.draw(Panel(), bpy.context)
        assert drawn[:3] == ["Basis", "Lean", "Stretch"]
        assert {"Advanced", "easing", "stretch", "extra_turns", "engine", "seed"} <= set(drawn)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("Basis", "Grin", "Stretch"), "There is no shape key 'Grin'; choose inner key 1 from those of the mesh."),
        (("Basis", "Lean", "", "Stretch"), "Choose inner key 2."),
        (("Basis", "Lean", "Grin"), "There is no shape key 'Grin'; choose the last key from those of the mesh."),
        (("Basis", "Lean", "Lean"), "'Lean' comes twice in a row; choose different keys one after the other."),
        (("Basis", "Broken", "Lean"), "From 'Basis' to 'Broken': Vertex 3 of the second key has"),
    ],
)
def test_keys_that_are_no_chain(
    figure: bpy.types.Object, quick_map: list[FitOptions], state: State, names: tuple[str, ...], said: str
) -> None:
    broken = figure.shape_key_add(name="Broken", from_mix=False)
    values = np.zeros(3 * len(broken.points), dtype=np.float32)
    values[10] = np.nan
    broken.points.foreach_set("co", values)
    before = state()
    with pytest.raises(RuntimeError) as caught:
        bake(*names)
    assert str(caught.value).startswith(f"Error: {said}")
    assert state() == before
    assert quick_map == []


def test_a_chain_has_room_for_999_steps() -> None:
    assert BakeRequest(("A", "B", "A", "B"), 332).play_options.count == 332
    with pytest.raises(InputError, match="333 in-betweens are not possible; 1 to 332 are"):
        BakeRequest(("A", "B", "A", "B"), 333)
    with pytest.raises(InputError, match="501 keys in a row are too many"):
        BakeRequest(("A", "B") * 250 + ("A",), 1)
