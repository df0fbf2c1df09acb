# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What would move the mesh twice is found and said, and one click ends it."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.keys.double_motion import double_motion
from qc3d_addon.blender.store.records import Record

from .test_panel_results import drawn

pytestmark = pytest.mark.usefixtures("quick_map")

Shown = Callable[..., np.ndarray]
SLIDER = "Basis_to_Lean"


@pytest.fixture
def baked(figure: bpy.types.Object) -> bpy.types.Object:
    choices = {"mode": "linear", "easing": "ease-in-out", "count": 3, "play_on": "slider"}
    assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Lean", **choices) == {"FINISHED"}
    return figure


def said(obj: bpy.types.Object) -> list[str]:
    chains = Record.read(obj.data.shape_keys).chains
    return double_motion(obj, chains[-1], chains)


def switch_on(obj: bpy.types.Object) -> str:
    obj.data.shape_keys.key_blocks["Lean"].value = 0.5
    return "Key 'Lean' has the value 0.50"


def drive(obj: bpy.types.Object) -> str:
    obj.data.shape_keys.driver_add('key_blocks["Lean"].value')
    return "Key 'Lean' is driven"


def animate(obj: bpy.types.Object) -> str:
    for frame, value in ((40, 1.0), (1, 0.0)):  # off at this frame
        obj.data.shape_keys.key_blocks["Lean"].value = value
        obj.data.shape_keys.key_blocks["Lean"].keyframe_insert("value", frame=frame)
    return "Key 'Lean' is animated"


def animate_by_a_strip(obj: bpy.types.Object) -> str:
    animate(obj)
    animation = obj.data.shape_keys.animation_data
    track = animation.nla_tracks.new()
    strip = track.strips.new("Strip", 1, animation.action)
    if hasattr(strip, "action_slot") and strip.action_slot is None:
        strip.action_slot = animation.action.slots[0]
    animation.action = None
    return "Key 'Lean' is animated"


@pytest.mark.parametrize("change", [switch_on, drive, animate, animate_by_a_strip])
def test_a_key_that_moves_by_itself(baked: bpy.types.Object, change: Callable[[bpy.types.Object], str]) -> None:
    assert said(baked) == []
    assert "play_on_key" not in [name for name, _ in drawn(baked).buttons]
    sentence = change(baked)
    (found,) = said(baked)
    assert found.startswith(sentence)
    layout = drawn(baked)
    assert any(text.startswith(sentence) for text in layout.texts)
    assert "play_on_key" in [name for name, _ in layout.buttons]
    baked.data.shape_keys.key_blocks["Lean"].mute = True
    assert said(baked) == []


def test_one_click_turns_to_the_key(baked: bpy.types.Object, shown: Shown) -> None:
    seen = [shown(baked, **{SLIDER: place}) for place in (0.0, 0.3, 0.5, 1.0)]
    baked[SLIDER] = 0.0
    baked.data.shape_keys.key_blocks[f"{SLIDER}_50"].points[3].co.x += 0.5  # sculpted
    seen[2] = shown(baked, **{SLIDER: 0.5})
    baked[SLIDER] = 0.0
    assert bpy.ops.qc3d.play_on_key() == {"FINISHED"}
    assert SLIDER not in baked
    keys = baked.data.shape_keys
    assert keys.key_blocks.keys() == ["Basis", "Lean", "Stretch", "Lean_25", "Lean_50", "Lean_75"]
    (chain,) = Record.read(keys).chains
    assert (chain.on_key, chain.slider, chain.request["play_on"]) == ("Lean", "Lean", "key")
    for place in (0, 2, 3):
        keys.key_blocks["Lean"].value = (0.0, 0.3, 0.5, 1.0)[place]
        keys.update_tag()
        np.testing.assert_allclose(shown(baked), seen[place], atol=1e-6)
    assert said(baked) == []
    assert bpy.ops.qc3d.rebake() == {"FINISHED"}


def test_two_bakes_from_one_key_that_is_not_the_basis(figure: bpy.types.Object) -> None:
    choices = {"mode": "linear", "count": 1, "play_on": "slider", "from_key": "Lean"}
    bpy.ops.qc3d.bake_inbetweens(to_key="Stretch", **choices)
    assert said(figure) == []
    bpy.ops.qc3d.bake_inbetweens(to_key="Basis", **choices)
    assert said(figure) == [
        "The slider 'Lean_to_Stretch' starts at 'Lean' too, which then shows twice; keep one of them."
    ]
    with pytest.raises(RuntimeError, match="'Basis' is the Basis, which has no value"):
        bpy.ops.qc3d.play_on_key()


def test_in_betweens_that_no_record_knows(figure: bpy.types.Object) -> None:
    choices = {"mode": "linear", "count": 1, "from_key": "Basis", "to_key": "Lean"}
    bpy.ops.qc3d.bake_inbetweens(**choices)
    figure.data.shape_keys["qc3d"] = 7
    assert bpy.ops.qc3d.forget_record() == {"FINISHED"}
    bpy.ops.qc3d.bake_inbetweens(**choices)
    (chain,) = Record.read(figure.data.shape_keys).chains
    assert "Key 'Lean_50', of an earlier bake without a record, also follows 'Lean'; delete it." in chain.result.notes
