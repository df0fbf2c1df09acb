# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh with ten thousand shape keys, and a chain with the largest number of steps."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.keys import drivers
from qc3d_addon.blender.store.names import MAX_STEPS
from qc3d_addon.blender.store.records import Record

from ..test_panel_results import drawn

pytestmark = pytest.mark.usefixtures("quick_map")

MANY = 10_000
SLIDER = "Basis_to_Key 9000"


@pytest.fixture
def crowd(figure: bpy.types.Object) -> bpy.types.Object:
    """The figure with ten thousand keys, "Key 3" to "Key 9999", each of another shape."""
    rest = np.empty(3 * len(figure.data.vertices), dtype=np.float32)
    figure.data.vertices.foreach_get("co", rest)
    for number in range(3, MANY):
        key = figure.shape_key_add(name=f"Key {number}", from_mix=False)
        key.value = 0.0
        key.points.foreach_set("co", rest * np.float32(1.0 + number / MANY))
    return figure


def test_everything_works_among_ten_thousand_keys(crowd: bpy.types.Object, shown: Callable[..., np.ndarray]) -> None:
    keys = crowd.data.shape_keys
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key="Key 9000", count=2, mode="linear"
    ) == {"FINISHED"}
    assert len(keys.key_blocks) == MANY + 3
    rest = np.array([vertex.co for vertex in crowd.data.vertices])
    for step in range(4):
        np.testing.assert_allclose(shown(crowd, **{SLIDER: step / 3}), rest * (1.0 + 0.3 * step), atol=1e-5)
    crowd[SLIDER] = 0.0
    names = keys.key_blocks.keys()
    drawn(crowd)
    for operator in (bpy.ops.qc3d.rebake, bpy.ops.qc3d.heat_map, bpy.ops.qc3d.live_scrub, bpy.ops.qc3d.live_scrub):
        assert operator() == {"FINISHED"}
    assert keys.key_blocks.keys() == names
    assert bpy.ops.qc3d.absolute_keys() == {"FINISHED"}
    assert len(bpy.data.objects["Figure absolute"].data.shape_keys.key_blocks) == 25
    bpy.data.objects.remove(bpy.data.objects["Figure absolute"])
    assert bpy.ops.qc3d.remove() == {"FINISHED"}
    assert keys.key_blocks.keys() == names[:MANY]


def test_a_panel_looks_only_at_the_drivers_of_its_own_keys(
    crowd: bpy.types.Object, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Key 9000", count=2, mode="linear")
    looked_at = []
    reads = drivers._reads_alone
    monkeypatch.setattr(drivers, "_reads_alone", lambda *given: looked_at.append(1) or reads(*given))
    for number in range(3, 1000):
        crowd.data.shape_keys.key_blocks[f"Key {number}"].driver_add("mute")
    drawn(crowd)
    assert 0 < len(looked_at) < 20


def test_as_many_steps_as_there_can_be(figure: bpy.types.Object, shown: Callable[..., np.ndarray]) -> None:
    count = MAX_STEPS - 1
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key="Lean", count=count, mode="linear"
    ) == {"FINISHED"}
    (chain,) = Record.read(figure.data.shape_keys).chains
    assert chain.intervals == MAX_STEPS
    assert len(chain.keys) == MAX_STEPS
    assert bpy.ops.qc3d.heat_map() == {"FINISHED"}
    assert bpy.ops.qc3d.absolute_keys() == {"FINISHED"}
    copy = bpy.data.objects["Figure absolute"]
    expected = shown(figure, Basis_to_Lean=0.5)
    np.testing.assert_allclose(shown(copy), expected, atol=2e-4)  # of so many the weights are steep
    assert bpy.ops.qc3d.remove() == {"FINISHED"}
    assert len(figure.data.shape_keys.key_blocks) == 3
    with pytest.raises(RuntimeError, match=f"{count} in-betweens are not possible; 1 to 498 are"):
        bpy.ops.qc3d.bake_inbetweens(
            play_on="slider", from_key="Basis", via=[{"name": "Stretch"}], to_key="Lean", count=count
        )
