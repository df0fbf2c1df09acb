# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which keys the panel and the operators take where none are named."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.bake.suggested_keys import sculpted_between, suggested_keys

from .conftest import add_key

pytestmark = pytest.mark.usefixtures("quick_map")


def make_active(obj: bpy.types.Object, name: str) -> None:
    obj.active_shape_key_index = obj.data.shape_keys.key_blocks.find(name)


def test_the_base_and_the_active_key(figure: bpy.types.Object) -> None:
    make_active(figure, "Stretch")
    settings = figure.qc3d
    assert (settings.first, settings.last) == ("Basis", "Stretch")
    assert (settings.from_key, settings.to_key) == ("", "")  # drawing writes nothing
    make_active(figure, "Lean")
    assert (settings.first, settings.last) == ("Basis", "Lean")
    assert bpy.ops.qc3d.bake_inbetweens(mode="linear", count=1) == {"FINISHED"}
    assert figure.data.shape_keys.key_blocks.keys() == ["Basis", "Lean", "Stretch", "Lean_50"]
    make_active(figure, "Lean_50")  # an in-between means its key
    assert (settings.first, settings.last) == ("Basis", "Lean")


def test_what_a_key_is_relative_to_comes_first(figure: bpy.types.Object) -> None:
    blocks = figure.data.shape_keys.key_blocks
    blocks["Stretch"].relative_key = blocks["Lean"]
    make_active(figure, "Stretch")
    assert suggested_keys(figure, "", "") == ("Lean", "Stretch")


def test_chosen_keys_stay(figure: bpy.types.Object) -> None:
    make_active(figure, "Lean")
    settings = figure.qc3d
    settings.last = "Stretch"
    assert (settings.to_key, settings.first, settings.last) == ("Stretch", "Basis", "Stretch")
    settings.first = "Lean"
    assert (settings.from_key, settings.first) == ("Lean", "Lean")
    settings.first = settings.last = ""
    assert (settings.first, settings.last) == ("Basis", "Lean")
    assert suggested_keys(figure, "Lean", "") == ("Lean", "")  # the active one is the first already


def test_the_basis_says_nothing_where_there_are_several_keys(figure: bpy.types.Object) -> None:
    make_active(figure, "Basis")
    assert suggested_keys(figure, "", "") == ("Basis", "")
    with pytest.raises(RuntimeError, match="Choose the second key"):
        bpy.ops.qc3d.bake_inbetweens()
    figure.shape_key_remove(figure.data.shape_keys.key_blocks["Stretch"])
    make_active(figure, "Basis")
    assert suggested_keys(figure, "", "") == ("Basis", "Lean")


def test_a_script_that_names_the_last_key_gets_its_base(figure: bpy.types.Object) -> None:
    make_active(figure, "Lean")
    assert bpy.ops.qc3d.bake_inbetweens(to_key="Stretch", mode="linear", count=1) == {"FINISHED"}
    assert "Stretch_50" in figure.data.shape_keys.key_blocks
    with pytest.raises(RuntimeError, match="Choose the first key"):
        bpy.ops.qc3d.bake_inbetweens(from_key="", to_key="Stretch")


def half(part: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda rest: rest + part * np.maximum(rest[:, 2:], 0.0) ** 2 * [0.4, 0.1, 0.3]


@pytest.mark.parametrize("separator", ["_", "", ".", " "])
def test_sculpted_keys_named_by_percentages_are_offered(figure: bpy.types.Object, separator: str) -> None:
    names = [f"Lean{separator}{percent}" for percent in (75, 25, 50)]
    for name, part in zip(names, (0.75, 0.25, 0.5), strict=True):
        add_key(figure, name, half(part))
    add_key(figure, "Leaning_50", half(0.5))
    assert sculpted_between(figure, "Lean") == {names[1]: 0.25, names[2]: 0.5, names[0]: 0.75}
    assert sculpted_between(figure, "Stretch") == {}
    make_active(figure, "Lean")
    assert bpy.ops.qc3d.go_through_sculpted() == {"FINISHED"}
    assert [inner.name for inner in figure.qc3d.via] == [names[1], names[2], names[0]]
    assert (figure.qc3d.from_key, figure.qc3d.to_key) == ("Basis", "Lean")
    assert figure.qc3d.via_timing == "even"


def test_uneven_ones_are_offered_at_the_values_in_their_names(figure: bpy.types.Object) -> None:
    make_active(figure, "Lean")
    add_key(figure, "Lean_2", half(0.3))  # a second version, not an in-between at 2 %
    with pytest.raises(RuntimeError, match="No keys are named as in-betweens of 'Lean'"):
        bpy.ops.qc3d.go_through_sculpted()
    add_key(figure, "Lean_30", half(0.3))
    add_key(figure, "Lean.30", half(0.3))  # there can be one key at a place
    assert sculpted_between(figure, "Lean") == {"Lean_30": 0.3}
    add_key(figure, "Lean_66", half(0.66))
    assert bpy.ops.qc3d.go_through_sculpted() == {"FINISHED"}
    assert [(row.name, round(row.at, 6)) for row in figure.qc3d.via] == [("Lean_30", 0.3), ("Lean_66", 0.66)]
    assert figure.qc3d.via_timing == "value"
    for name, other in (("Lean_30", "Lean_33"), ("Lean.30", "Other")):
        figure.data.shape_keys.key_blocks[name].name = other
    assert bpy.ops.qc3d.go_through_sculpted() == {"FINISHED"}
    assert figure.qc3d.via_timing == "even"  # exactly at thirds


def test_made_keys_are_not_offered(figure: bpy.types.Object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", mode="linear", count=1) == {"FINISHED"}
    assert "Lean_50" in figure.data.shape_keys.key_blocks
    assert sculpted_between(figure, "Lean") == {}
