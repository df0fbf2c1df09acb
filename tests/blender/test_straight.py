# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mirrored key is refused at once with the advice to use mode *straight*, which bakes, re-bakes and plays it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.store import kept_measures
from qc3d_addon.blender.store.records import Record

Shapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]
CHOICES = {"from_key": "Basis", "to_key": "Mirrored", "count": 3, "engine": 'delaunay', "quality": 'normal'}


@pytest.fixture
def mirrored(figure: bpy.types.Object) -> bpy.types.Object:
    rest = np.empty(3 * len(figure.data.vertices), dtype=np.float32)
    figure.data.vertices.foreach_get("co", rest)
    key = figure.shape_key_add(name="Mirrored", from_mix=False)
    key.value = 0.0
    key.points.foreach_set("co", (rest.reshape(-1, 3) * [-1.0, 1.0, 1.0] + [3.0, 0.0, 0.0]).astype(np.float32).ravel())
    return figure


@pytest.mark.parametrize("mode", ["natural", "linear"])
def test_a_mirrored_key_is_refused_with_an_offer(
    mirrored: bpy.types.Object, state: Callable[[], dict[str, Any]], mode: str
) -> None:
    before = state()
    with pytest.raises(RuntimeError, match=r"mirrored or turned inside out: .* Choose the mode straight"):
        bpy.ops.qc3d.bake_inbetweens(play_on="slider", mode=mode, **CHOICES)
    assert state() == before


def test_the_straight_blend_is_baked_instead(mirrored: bpy.types.Object, shapes: Shapes, tmp_path: Path) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", mode='straight', **CHOICES) == {'FINISHED'}
    made = shapes(mirrored)
    for step in range(1, 4):
        expected = made["Basis"] + step / 4 * (made["Mirrored"] - made["Basis"])
        np.testing.assert_allclose(made[f"Basis_to_Mirrored_{25 * step}"], expected, atol=1e-6)
    keys = mirrored.data.shape_keys
    record = Record.read(keys)
    (chain,) = record.chains
    assert record.maps == []
    assert chain.result.residual is None
    assert chain.result.folds is None
    assert not kept_measures.has(keys, chain.slider)
    assert bpy.ops.qc3d.rebake() == {'FINISHED'}
    with pytest.raises(RuntimeError, match="makes no map; bake in another mode"):
        bpy.ops.qc3d.save_map(filepath=str(tmp_path / "map.qc3dmap"))
    assert list(tmp_path.iterdir()) == []


def test_on_the_key_a_bake_in_another_mode_takes_its_place(figure: bpy.types.Object) -> None:
    choices = {**CHOICES, "to_key": "Lean"}
    bpy.ops.qc3d.bake_inbetweens(play_on="key", mode='linear', **choices)
    bpy.ops.qc3d.heat_map(measure='stretch')
    assert "QC3D" in " ".join(figure.modifiers.keys())
    bpy.ops.qc3d.bake_inbetweens(play_on="key", mode='straight', **choices)
    assert not kept_measures.has(figure.data.shape_keys, "Lean")
    assert list(figure.modifiers) == []  # the heat map has nothing to show
    bpy.ops.qc3d.bake_inbetweens(play_on="key", mode='linear', **choices)
    assert kept_measures.has(figure.data.shape_keys, "Lean")
