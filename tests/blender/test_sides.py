# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters that are nearly symmetric: mirrored bakes, and keys split into their sides."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from qc3d_addon.blender.combinations import verdicts
from qc3d_addon.blender.keys.sides import sides_of

from .conftest import add_key, coordinates

State = Callable[[], dict[str, object]]
Shown = Callable[..., np.ndarray]

pytestmark = pytest.mark.usefixtures("quick_map")


def head(moved: int = 0, bump: float = 0.0) -> bpy.types.Object:
    """A ball of quads with the keys Basis, Wink.L and Smile; ``moved`` vertices of the right side are out of place."""
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    obj = bpy.context.active_object
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.subdivide(number_cuts=5)
    bpy.ops.object.mode_set(mode='OBJECT')
    obj.name = "Head"
    rest = np.array([vertex.co[:] for vertex in obj.data.vertices]).round(6)
    basis = rest.copy()
    right = np.flatnonzero((rest[:, 0] < -0.3) & (rest[:, 2] > -0.5))[:moved]
    basis[right] += bump * np.array([0.3, 1.0, 0.5])
    for vertex, place in zip(obj.data.vertices, basis, strict=True):
        vertex.co = place
    add_key(obj, "Basis", lambda _: basis)
    add_key(obj, "Wink.L", lambda _: basis + np.maximum(rest[:, :1], 0.0) ** 2 * [0.2, 0.1, 0.4])
    add_key(obj, "Smile", lambda _: basis + rest[:, :1] ** 2 * [0.0, 0.3, 0.2])
    return obj


def grin() -> bpy.types.Object:
    """The ball with one key, Grin, that turns both sides upward."""
    obj = head()
    for name in ("Wink.L", "Smile"):
        obj.shape_key_remove(obj.data.shape_keys.key_blocks[name])
    rest = basis_of(obj)
    turned = np.abs(rest[:, 0])
    shape = np.stack([np.sign(rest[:, 0]) * np.sin(turned), rest[:, 1], rest[:, 2] + 1.0 - np.cos(turned)], axis=1)
    add_key(obj, "Grin", lambda _: shape)
    return obj


def difference(obj: bpy.types.Object, shown: Shown) -> float:
    """Largest distance of both sides together from the whole key, at values from 0 to 1."""
    keys = obj.data.shape_keys.key_blocks
    found = []
    for value in np.linspace(0.0, 1.0, 9):
        shapes = []
        for names in (("Grin",), ("Grin.L", "Grin.R")):
            for name in names:
                keys[name].value = value
            shapes.append(shown(obj).copy())
            for name in names:
                keys[name].value = 0.0
        found.append(float(np.abs(shapes[0] - shapes[1]).max()))
    return max(found)


def mirrored(obj: bpy.types.Object, **choices: object) -> np.ndarray:
    asked = {"from_key": "Basis", "to_key": "Wink.L", "count": 1, "mode": "linear", "play_on": "slider"}
    assert bpy.ops.qc3d.bake_inbetweens(**asked) == {'FINISHED'}
    assert bpy.ops.qc3d.mirror(**choices) == {'FINISHED'}
    return coordinates(obj.data.shape_keys.key_blocks["Basis_to_Wink.R_100"])


def basis_of(obj: bpy.types.Object) -> np.ndarray:
    return coordinates(obj.data.shape_keys.reference_key)


def test_symmetric_to_the_bit() -> None:
    obj = head()
    shape, rest = mirrored(obj), basis_of(obj)
    wink = coordinates(obj.data.shape_keys.key_blocks["Wink.L"])
    partner = np.array([int(np.abs(rest - place * [-1.0, 1.0, 1.0]).sum(axis=1).argmin()) for place in rest])
    assert np.array_equal(shape, wink[partner] * np.float32([-1.0, 1.0, 1.0]))


@pytest.mark.parametrize("moved", [1, 8])
def test_a_few_without_a_partner_are_said(moved: int, capfd: pytest.CaptureFixture[str]) -> None:
    """Those and the ones that lost theirs move as what is nearest there; all others as on a symmetric mesh."""
    clean = mirrored(head()) - basis_of(bpy.context.active_object)
    obj = head(moved, 0.05)
    found = mirrored(obj) - basis_of(obj)
    assert f"{2 * moved} of 218 vertices have no mirror image" in capfd.readouterr().out
    assert np.abs(found - clean).max() < 0.2 * np.abs(clean).max()
    assert (np.abs(found - clean).max(axis=1) < 1e-6).sum() >= 218 - 2 * moved


def test_topology_finds_them(capfd: pytest.CaptureFixture[str]) -> None:
    clean = mirrored(head()) - basis_of(bpy.context.active_object)
    obj = head(8, 0.05)
    found = mirrored(obj, use_topology=True) - basis_of(obj)
    assert "no mirror image" not in capfd.readouterr().out
    np.testing.assert_allclose(found, clean, atol=1e-6)


def test_many_without_a_partner_are_refused(state: State) -> None:
    obj = head(60, 0.05)
    with pytest.raises(RuntimeError, match=r"120 of 218 vertices have no mirror image.* choose Topology"):
        mirrored(obj)
    mirrored(obj, use_topology=True)


class TestSplit:
    @pytest.mark.parametrize("falloff", [0.0, 0.1, 0.7])
    def test_the_sides_add_up_to_the_key(self, falloff: float) -> None:
        obj = head()
        assert bpy.ops.qc3d.split_key(key="Smile", falloff=falloff) == {'FINISHED'}
        keys, rest = obj.data.shape_keys.key_blocks, basis_of(obj)
        left, right, whole = (coordinates(keys[name]) - rest for name in ("Smile.L", "Smile.R", "Smile"))
        np.testing.assert_allclose(left + right, whole, atol=1e-6)
        beyond = rest[:, 0] > max(falloff, 1e-3)
        assert np.array_equal(coordinates(keys["Smile.L"])[beyond], coordinates(keys["Smile"])[beyond])
        assert not right[beyond].any()
        assert not left[rest[:, 0] < -max(falloff, 1e-3)].any()
        assert keys["Smile.L"].value == 0.0

    def test_sides_are_mirror_images_and_bake(self) -> None:
        obj = head()
        bpy.ops.qc3d.split_key(key="Smile", falloff=0.5)
        keys = obj.data.shape_keys.key_blocks
        assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Smile.L", count=2, mode="linear") == {'FINISHED'}
        assert bpy.ops.qc3d.mirror() == {'FINISHED'}
        assert {"Smile.L_33", "Smile.R_33"} <= set(keys.keys())

    @pytest.mark.parametrize("order", ["split last", "split first"])
    def test_the_in_betweens_of_the_sides_add_up_too(self, order: str, shown: Shown) -> None:
        """Baked by themselves, the sides would turn less where they fade into each other than both together."""
        obj = grin()
        keys = obj.data.shape_keys.key_blocks
        if order == "split first":
            assert bpy.ops.qc3d.split_key(key="Grin", falloff=0.8) == {'FINISHED'}
            assert bpy.ops.qc3d.bake_keys(count=3) == {'FINISHED'}
        else:
            assert bpy.ops.qc3d.bake_inbetweens(from_key="Basis", to_key="Grin", count=3) == {'FINISHED'}
        before = difference(obj, shown) if order == "split first" else 1.0
        assert bpy.ops.qc3d.split_key(key="Grin", falloff=0.8) == {'FINISHED'}
        assert difference(obj, shown) < 1e-6 < 1e-4 < before
        assert {"Grin.L_50", "Grin.R_50"} <= set(keys.keys())
        # The left side does not move on the right, and they are left alone as long as nothing changes.
        rest = basis_of(obj)
        assert np.array_equal(coordinates(keys["Grin.L_50"])[rest[:, 0] < -0.8], rest[rest[:, 0] < -0.8])
        half_way = coordinates(keys["Grin.L_50"])
        bpy.ops.qc3d.bake_keys(count=3)
        assert np.array_equal(coordinates(keys["Grin.L_50"]), half_way)

    def test_sides_of_a_key_need_no_combination(self, state: State) -> None:
        obj = grin()
        bpy.ops.qc3d.split_key(key="Grin", falloff=0.8)
        before = state()
        with pytest.raises(RuntimeError, match=r"'Grin\.R' add up to 'Grin', so there is nothing to correct"):
            bpy.ops.qc3d.combine_keys(first="Grin.L", second="Grin.R")
        assert state() == before
        bpy.ops.qc3d.judge_pairs()
        texts = {frozenset((one.outer, one.inner)): one.text for one in verdicts.found(obj)}
        assert texts[frozenset(("Grin.L", "Grin.R"))].startswith("adding is right")
        assert sides_of(obj, "Grin") == ("Grin.L", "Grin.R")
        assert sides_of(obj, "Grin.L") is None

    @pytest.mark.parametrize(
        ("key", "problem"),
        [("Basis", "is the Basis"), ("Wink.L", "is of one side already"), ("None", "None"), ("Smile", "already")],
    )
    def test_refused(self, key: str, problem: str, state: State) -> None:
        obj = head()
        if key == "Smile":
            obj.shape_key_add(name="Smile.R")
        before = state()
        with pytest.raises(RuntimeError, match=problem):
            bpy.ops.qc3d.split_key(key=key)
        assert state() == before
