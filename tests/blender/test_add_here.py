# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One more in-between, where the slider or key is."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from qc3d_addon.blender.store.records import Record

pytestmark = pytest.mark.usefixtures("quick_map")


def test_on_the_key(figure: bpy.types.Object, record: Callable[[bpy.types.Object], Record]) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", mode="linear", count=1) == {"FINISHED"}
    blocks = figure.data.shape_keys.key_blocks
    blocks["Lean"].value = 0.8
    assert bpy.ops.qc3d.add_here() == {"FINISHED"}
    assert {"Lean_50", "Lean_80"} < set(blocks.keys())
    assert record(figure).chains[0].places == pytest.approx((0.0, 0.5, 0.8, 1.0))
    assert blocks["Lean"].value == pytest.approx(0.8)
    blocks["Lean"].value = 0.25
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}  # has it again
    assert bpy.ops.qc3d.add_here() == {"FINISHED"}
    assert record(figure).chains[0].places == pytest.approx((0.0, 0.25, 0.5, 0.8, 1.0))


@pytest.mark.parametrize("tolerance", [False, True])
def test_on_a_slider(
    figure: bpy.types.Object, record: Callable[[bpy.types.Object], Record], tolerance: bool
) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(
        from_key="Basis", to_key="Lean", mode="linear", count=1, use_tolerance=tolerance, play_on="slider"
    ) == {"FINISHED"}
    before = set(record(figure).chains[0].places)
    figure["Basis_to_Lean"] = 0.313
    assert bpy.ops.qc3d.add_here() == {"FINISHED"}
    places = record(figure).chains[0].places
    assert places == pytest.approx(sorted({*before, 0.313}))
    assert "Basis_to_Lean_31" in figure.data.shape_keys.key_blocks


@pytest.mark.parametrize(
    ("place", "sentence"),
    [
        (0.0, "is at 0.00; set it between 0 and 1"),
        (1.5, "is at 1.50; set it between 0 and 1"),
        (0.504, "is at 0.504, and there is an in-between at 0.500"),
        (0.996, "is at 0.996, and there is an end at 1.000"),
    ],
)
def test_where_there_is_no_place(figure: bpy.types.Object, place: float, sentence: str) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(
        from_key="Basis", to_key="Lean", mode="linear", count=1, play_on="slider"
    ) == {"FINISHED"}
    figure["Basis_to_Lean"] = place
    names = figure.data.shape_keys.key_blocks.keys()
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.qc3d.add_here()
    assert figure.data.shape_keys.key_blocks.keys() == names
