# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframes of the slider: made on request, never twice, and never replacing the animator's own."""

from __future__ import annotations

import bpy
import pytest

from qc3d_addon.blender import compat
from qc3d_addon.blender.keys.control import slider_path

pytestmark = pytest.mark.usefixtures("quick_map")

SLIDER = "Basis_to_Lean"
PATH = slider_path(SLIDER)


def bake(**choices: object) -> None:
    pair = {"from_key": "Basis", "to_key": "Lean"}
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", **pair, count=1, mode='linear', **choices) == {'FINISHED'}


def keyframes(obj: bpy.types.Object) -> list[tuple[float, float]]:
    curve = compat.find_fcurve(obj, PATH)
    return [] if curve is None else [tuple(point.co) for point in curve.keyframe_points]


def curves(obj: bpy.types.Object) -> list[str]:
    action = obj.animation_data.action
    if not hasattr(action, "layers"):
        return [curve.data_path for curve in action.fcurves]
    bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
    return [curve.data_path for bag in bags for curve in bag.fcurves]


def test_the_slider_goes_from_the_first_to_the_second_key_at_even_speed(figure: bpy.types.Object) -> None:
    bake(use_keyframes=True, frame_start=10, frame_end=20)
    assert keyframes(figure) == [(10.0, 0.0), (20.0, 1.0)]
    for frame, value in ((1, 0.0), (10, 0.0), (15, 0.5), (18, 0.8), (20, 1.0), (30, 1.0)):
        bpy.context.scene.frame_set(frame)
        assert figure[SLIDER] == pytest.approx(value, abs=1e-6)
    bpy.context.scene.frame_set(15)
    assert figure.data.shape_keys.key_blocks["Basis_to_Lean_50"].value == 1.0


def test_without_the_request_there_are_none(figure: bpy.types.Object) -> None:
    bake()
    assert figure.animation_data is None or figure.animation_data.action is None


def test_baking_again_makes_no_second_curve_and_keeps_edited_timing(figure: bpy.types.Object) -> None:
    bake(use_keyframes=True, frame_start=1, frame_end=11)
    compat.find_fcurve(figure, PATH).keyframe_points.insert(5, 0.9)
    bake(use_keyframes=True, frame_start=1, frame_end=11)
    bake()
    assert curves(figure) == [PATH]
    assert keyframes(figure) == [(1.0, 0.0), (5.0, pytest.approx(0.9)), (11.0, 1.0)]


def test_another_range_moves_the_keyframes_that_a_bake_made(figure: bpy.types.Object) -> None:
    bake(use_keyframes=True, frame_start=1, frame_end=11)
    bake(use_keyframes=True, frame_start=5, frame_end=50)
    assert curves(figure) == [PATH]
    assert keyframes(figure) == [(5.0, 0.0), (50.0, 1.0)]


def test_the_animators_own_keyframes_stay(figure: bpy.types.Object) -> None:
    from qc3d_addon.blender.bake.request import BakeRequest
    from qc3d_addon.blender.bake.run import bake_object
    from qc3d_addon.solver.settings import FrameOptions

    bake()
    figure[SLIDER] = 0.25
    figure.keyframe_insert(PATH, frame=7)
    linear = FrameOptions("linear")
    request = BakeRequest(("Basis", "Lean"), 1, frame_options=linear, keyframes=(1, 11), play_on="slider")
    result = bake_object(figure, request)
    assert keyframes(figure) == [(7.0, 0.25)]
    assert f"The slider '{SLIDER}' is already animated; its keyframes were left as they are." in result.notes


def test_other_animation_of_the_object_stays(figure: bpy.types.Object) -> None:
    figure.keyframe_insert("location", frame=3)
    action = figure.animation_data.action
    bake(use_keyframes=True)
    assert figure.animation_data.action == action
    assert curves(figure) == ["location", "location", "location", PATH]


def test_an_action_that_no_slot_is_chosen_from_gets_the_objects_own_slot(figure: bpy.types.Object) -> None:
    figure.keyframe_insert("location", frame=3)
    if hasattr(figure.animation_data, "action_slot"):
        figure.animation_data.action_slot = None
    bake(use_keyframes=True)
    bpy.context.scene.frame_set(25)
    assert figure[SLIDER] == 1.0
