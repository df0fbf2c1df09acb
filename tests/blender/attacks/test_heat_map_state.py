# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged heat-map data in a file: the panel draws, and the heat map can be hidden and shown again."""

from __future__ import annotations

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from qc3d_addon.blender.heat_map import heat_map, legend
from qc3d_addon.blender.heat_map.colors import linear

from ..test_panel_results import drawn

pytestmark = pytest.mark.usefixtures("quick_map")

STATE = "qc3d_heat_map"
State = Callable[[], dict[str, Any]]
SPOILED: list[object] = [
    7,
    b"{}",
    [1, 2],
    {"slider": "a"},
    "",
    "{",
    "[]",
    "null",
    "[" * 100_000 + "]" * 100_000,
    {"scale": None},
    {"scale": ["a", 0.5, 2.0]},
    {"scale": ["a", "b", "c", "d"]},
    {"scale": ["a", 0.0, 0.0, []]},
    {"scale": ["a", 0.5, 1e999, []]},
    {"scale": ["a", -2.0, 2.0, []]},
    {"scale": ["a", 0.5, 7.0, []]},
    {"scale": ["a", 10**400, 10**400, []]},
    {"measure": "none"},
    {"measure": ["stretch"]},
    {"measure": None},
    {"slider": 7},
    {"slider": ""},
    {"slider": "\ud800"},
    {"active_colour": 7},
    {"active_colour": ["Paint"]},
    {"active_colour": "\ud800"},
    {"active_colour": "none"},
]


@pytest.fixture
def shown(figure: bpy.types.Object) -> bpy.types.Object:
    """A bake with its heat map, over a color of the animator's own."""
    figure.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    choices = {"mode": "linear", "count": 1}
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", **choices) == {"FINISHED"}
    assert bpy.ops.qc3d.heat_map() == {"FINISHED"}
    return figure


@pytest.mark.parametrize("value", SPOILED, ids=lambda value: repr(value)[:40])
def test_it_can_be_hidden_and_shown_again(shown: bpy.types.Object, value: object) -> None:
    whole = json.loads(shown[STATE])
    is_part = isinstance(value, dict) and set(value) <= {"scale", "measure", "slider", "active_colour"}
    del shown[STATE]
    shown[STATE] = json.dumps({**whole, **value}) if isinstance(value, dict) and is_part else value
    found = heat_map.shown(shown)
    if found is not None:  # what the legend draws all the time
        assert all(0.0 <= place <= 1.0 and float(text) > 0.0 for place, text in found.scale.ticks)
        assert all(0.0 <= part <= 1.0 for color in found.scale.colors for part in linear(color))
    drawn(shown)
    shown.qc3d.measure = "volume"  # which shows it at once where a heat map is known
    assert bpy.ops.qc3d.heat_map(show="off") == {"FINISHED"}
    assert STATE not in shown
    assert not shown.modifiers
    assert not bpy.data.node_groups
    assert [attribute.name for attribute in shown.data.attributes if "QC3D" in attribute.name] == []
    assert bpy.ops.qc3d.heat_map(show="on") == {"FINISHED"}
    state = heat_map.shown(shown)
    assert state is not None
    assert heat_map.Shown(state.slider, state.measure, state.scale) == state


def test_another_modifier_of_that_name(shown: bpy.types.Object, state: State) -> None:
    bpy.ops.qc3d.heat_map(show="off")
    shown.modifiers.new(heat_map.NAME, 'SUBSURF')
    before = state()
    assert heat_map.shown(shown) is None
    with pytest.raises(RuntimeError, match=f"has another modifier named '{heat_map.NAME}'; rename that first"):
        bpy.ops.qc3d.heat_map(show="on")
    assert state() == before
    assert bpy.ops.qc3d.heat_map(show="off") == {"FINISHED"}
    assert [modifier.type for modifier in shown.modifiers] == ['SUBSURF']


class Shading:
    """Stands in for a view's shading, which takes two names and refuses others as Blender does."""

    def __init__(self) -> None:
        self.set: dict[str, str] = {}

    def __setattr__(self, name: str, value: object) -> None:
        if name != "set" and value not in ("SOLID", "MATERIAL", "RENDERED", "TEXTURE"):
            raise TypeError("enum not found")
        if name == "set":
            object.__setattr__(self, name, value)
        else:
            self.set[name] = str(value)


@pytest.mark.parametrize(
    ("kept", "found"),
    [
        (["RENDERED", "TEXTURE"], {"type": "RENDERED", "color_type": "TEXTURE"}),
        (["SOLID"], {"type": "SOLID"}),
        ("SOLID", {"type": "SOLID"}),
        (7, {"type": "SOLID"}),
        ([7, 7], {"type": "SOLID"}),
        ([], {"type": "SOLID"}),
    ],
)
def test_what_a_screen_keeps_of_its_view(kept: object, found: dict[str, str]) -> None:
    shading = Shading()
    space = SimpleNamespace(type="VIEW_3D", shading=shading)
    legend.leave(SimpleNamespace(space_data=space, screen={legend._SHADING: kept}))  # type: ignore[arg-type]
    assert shading.set == found
