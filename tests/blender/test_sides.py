# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters that are nearly symmetric: mirrored bakes, and keys split into their sides."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from .conftest import add_key, coordinates

State = Callable[[], dict[str, object]]

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
