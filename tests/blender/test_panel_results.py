# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of the panel that shows the results of each bake."""

from __future__ import annotations

import bpy
import pytest

from qc3d_addon.blender.ui.panel_results import QC3D_PT_results

pytestmark = pytest.mark.usefixtures("quick_map")

SLIDER = "Basis_to_Lean.L"


class Button:
    """Takes the properties that a panel gives to an operator."""


class Layout:
    """Stands in for Blender's, which only a window has: takes note of texts, and of operators with their sliders."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.buttons: list[tuple[str, Button]] = []
        self.lists: list[tuple[int, int]] = []

    def label(self, text: str, **options: object) -> None:
        self.texts.append(text)

    def prop(self, data: object, name: str, **options: object) -> None:
        self.texts.append(name)

    def prop_search(self, data: object, name: str, *where: object, **options: object) -> None:
        self.texts.append(name)

    def operator(self, name: str, **options: object) -> Button:
        assert hasattr(bpy.ops.qc3d, name.removeprefix("qc3d."))
        self.buttons.append((name.removeprefix("qc3d."), Button()))
        return self.buttons[-1][1]

    def panel(self, name: str, default_closed: bool) -> tuple[Layout, Layout]:
        assert default_closed
        return self, self

    def template_list(self, kind: str, name: str, data: object, collection: str, *active: object, **rows: int) -> None:
        assert hasattr(bpy.types, kind)
        self.lists.append((len(getattr(data, collection)), rows["rows"]))

    def context_pointer_set(self, name: str, data: object) -> None:
        pass

    def separator(self) -> None:
        pass

    def box(self) -> Layout:
        return self

    def row(self, **options: object) -> Layout:
        return self

    column = row


class Context:
    """What a panel looks at, with a wide sidebar."""

    class region:
        width = 10_000

    class preferences:
        class system:
            ui_scale = 1.0

    def __init__(self, obj: bpy.types.Object) -> None:
        self.active_object = obj
        self.selected_objects = [obj]


def drawn(obj: bpy.types.Object) -> Layout:
    class Panel:
        layout = Layout()

    assert QC3D_PT_results.poll(Context(obj))
    QC3D_PT_results.draw(Panel(), Context(obj))
    return Panel.layout


@pytest.fixture
def even() -> bpy.types.Object:
    """The active object: a symmetric sphere with the shape keys Basis and Lean.L."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    obj = bpy.context.active_object
    for name, lean in (("Basis", 0.0), ("Lean.L", 0.4)):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0
        for point in key.points:
            point.co.x += lean * max(point.co.z, 0.0) ** 2
    assert not QC3D_PT_results.poll(Context(obj))
    assert bpy.ops.qc3d.bake_inbetweens(
        play_on="slider", from_key="Basis", to_key="Lean.L", mode="linear", count=2
    ) == {"FINISHED"}
    return obj


def test_a_bake(even: bpy.types.Object) -> None:
    layout = drawn(even)
    assert layout.texts[0] == f'["{SLIDER}"]'
    assert [text for text in layout.texts if text.startswith("2 in-betweens in ")]
    assert "No folds, no new crossings" in layout.texts
    assert "Engine six" in layout.texts
    assert [text for text in layout.texts if text.startswith("Worst stretch +")]
    assert [text for text in layout.texts if text.startswith("Fitted within ")]
    assert {button.slider for _, button in layout.buttons} == {SLIDER}  # type: ignore[attr-defined]
    assert [name for name, _ in layout.buttons] == [
        "rebake",
        "live_scrub",
        "straight",
        "add_here",
        "select_worst",
        "heat_map",
        "mirror",
        "to_keyframes",
        "absolute_keys",
        "export_alembic",
        "save_map",
        "remove",
    ]


def test_a_lost_key_is_said(even: bpy.types.Object) -> None:
    key = even.data.shape_keys.key_blocks["Lean.L"]
    key.name, key.points[0].co.x = "Other", 7.0  # another name alone would be followed
    sentence = "Shape key 'Lean.L' was renamed or deleted; restore its name to re-bake, or make a new bake."
    assert sentence in drawn(even).texts


def test_a_lost_slider_is_said(even: bpy.types.Object) -> None:
    del even[SLIDER]
    assert f"The slider '{SLIDER}' was deleted; re-bake it first." in drawn(even).texts


def test_a_mirror_image_is_made_again_from_the_other_side(even: bpy.types.Object) -> None:
    assert bpy.ops.qc3d.mirror() == {"FINISHED"}
    layout = drawn(even)
    assert {f"Mirrored from {SLIDER}", "2 in-betweens"} < set(layout.texts)
    first = layout.buttons[0]  # the newest is shown
    assert (first[0], first[1].slider) == ("mirror", SLIDER)  # type: ignore[attr-defined]
    of_the_image = [name for name, button in layout.buttons[1:] if button.slider == "Basis_to_Lean.R"]  # type: ignore[attr-defined]
    assert "remove" in of_the_image
    assert "mirror" not in of_the_image
    assert "rebake" not in of_the_image


def test_several_bakes_are_a_list_with_the_details_of_the_chosen_one(even: bpy.types.Object) -> None:
    assert drawn(even).lists == []
    for count in range(4):
        name = f"Lean {count}"
        key = even.shape_key_add(name=name, from_mix=False)
        for point in key.points:
            point.co.y += 0.1 * (count + 1) * max(point.co.z, 0.0)
        even.qc3d.chosen = SLIDER
        assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key=name, mode="linear", count=1) == {"FINISHED"}
        assert even.qc3d.row == 0  # the newest
    layout = drawn(even)
    assert layout.lists == [(len(even.data.shape_keys.key_blocks), 5)]
    assert {button.slider for _, button in layout.buttons} == {"Lean 3"}  # type: ignore[attr-defined]
    even.qc3d.row = 4
    assert even.qc3d.chosen == SLIDER
    assert {button.slider for _, button in drawn(even).buttons} == {SLIDER}  # type: ignore[attr-defined]
    assert bpy.ops.qc3d.remove(slider="Lean 3") == {"FINISHED"}
    assert even.qc3d.row == 3
    assert bpy.ops.qc3d.remove(slider=SLIDER) == {"FINISHED"}
    assert even.qc3d.row == 0
    even.qc3d.row = 99
    assert even.qc3d.row == 0


def test_bakes_whose_keys_are_gone_can_be_removed(even: bpy.types.Object) -> None:
    assert bpy.ops.qc3d.bake_inbetweens(
        from_key="Basis", to_key="Lean.L", mode="straight", play_on="slider", count=1
    ) == {"FINISHED"}
    blocks = even.data.shape_keys.key_blocks
    while len(blocks) > 1:
        even.shape_key_remove(blocks[-1])
    removed = [button.slider for name, button in drawn(even).buttons if name == "remove"]  # type: ignore[attr-defined]
    assert sorted(removed) == [SLIDER, f"{SLIDER}_straight"]


def test_a_damaged_record_is_said(even: bpy.types.Object) -> None:
    even.data.shape_keys["qc3d"] = "{}"
    assert "is damaged" in drawn(even).texts[0]
