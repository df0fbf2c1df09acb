# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Halves of meshes: found, mirrored, and shut at their seams in every frame."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.keys.halves import MirrorPlane, mirror_planes, on_plane
from qc3d_addon.solver.keys.keypair import Ends, KeyPair, consecutive_pairs
from qc3d_addon.solver.settings import Mode
from qc3d_addon.solver.support.progress import Steps

from ..meshes import box_surface, enclosed_volume

pytestmark = pytest.mark.usefixtures("coarse_volume")


def halved(axes: tuple[int, ...]) -> tuple[Floats, Ints]:
    """A box around the origin cut along planes, what is on their positive side kept, without the cuts' faces."""
    points, faces = box_surface((4, 4, 6), (1.0, 1.2, 3.0))
    points[:, 2] -= 1.5
    for axis in axes:
        faces = faces[(points[faces][:, :, axis] > -1e-9).all(axis=1)]
    used, corners = np.unique(faces, return_inverse=True)
    return points[used], corners.reshape(-1, 3)


def swung(points: Floats, axes: tuple[int, ...]) -> Floats:
    """Bent within each of the planes; what is on them stays on them."""
    result = points.copy()
    for axis in range(3):
        if axis in axes:
            result[:, axis] *= 1.0 + 0.3 * points[:, 2] ** 2
        else:
            others = points[:, [other for other in range(3) if other != axis]]
            result[:, axis] += 0.25 * (others**2).sum(axis=1)
    return result


@pytest.mark.parametrize("axes", [(0,), (1,), (2,), (0, 1), (0, 2)])
def test_found_where_a_loop_lies_on_a_plane(axes: tuple[int, ...]) -> None:
    points, faces = halved(axes)
    planes = mirror_planes("auto", {"a": points, "b": swung(points, axes)}, faces)
    assert [plane.normal.index(1.0) for plane in planes] == list(axes) or len(axes) == 2
    # With two cuts the loop goes around an edge: neither plane has all of it, and the axes must be given.
    given = mirror_planes("".join("xyz"[axis] for axis in axes), {"a": points, "b": swung(points, axes)}, faces)  # type: ignore[arg-type]
    assert [plane.normal.index(1.0) for plane in given] == list(axes)


def test_not_found_where_it_does_not() -> None:
    points, faces = halved((0,))
    moved = points + [0.01, 0.0, 0.0]
    whole, whole_faces = box_surface((2, 2, 2), (1.0, 1.0, 1.0))
    assert not mirror_planes("auto", {"a": points, "b": moved}, faces)
    assert not mirror_planes("auto", {"a": whole}, whole_faces)
    assert not mirror_planes("none", {"a": points}, faces)
    with pytest.raises(InputError, match="Unknown mirror"):
        mirror_planes("w", {"a": points}, faces)  # type: ignore[arg-type]


@pytest.mark.parametrize("mode", ["natural", "linear", "straight"])
@pytest.mark.parametrize("axes", [(0,), (1,), (2,), (0, 1)])
def test_the_seam_stays_shut_and_the_whole_keeps_its_volume(axes: tuple[int, ...], mode: Mode) -> None:
    points, faces = halved(axes)
    later = swung(points, axes)
    mirror = "".join("xyz"[axis] for axis in axes)
    bake = qc3d.bake([points, later], faces, 3, mode=mode, mirror=mirror)  # type: ignore[arg-type]
    assert bake.frames.shape == (5, *points.shape)
    assert np.array_equal(bake.frames[0], points)
    assert np.array_equal(bake.frames[-1], later)
    for axis in axes:
        seam = points[:, axis] == 0.0
        assert seam.sum() > 4
        assert np.array_equal(bake.frames[:, seam, axis], np.zeros((5, seam.sum())))
    if mode == "natural":
        assert any("mirror image" in note for note in bake.report.notes)

        def volume(shape: Floats) -> float:
            pair = consecutive_pairs({"a": shape, "b": shape}, faces, None, ("a", "b"), None, mirror)["a", "b"]  # type: ignore[arg-type]
            return enclosed_volume(pair.key0, pair.faces)

        ends = volume(points), volume(later)
        for time, frame in zip(bake.times, bake.frames, strict=True):
            assert volume(frame) == pytest.approx((1.0 - time) * ends[0] + time * ends[1], rel=5e-3)


def test_the_half_moves_as_the_whole() -> None:
    points, faces = halved((0,))
    later = swung(points, (0,))
    pair = consecutive_pairs({"a": points, "b": later}, faces, None, ("a", "b"), None, "auto")["a", "b"]
    own = pair.own
    assert np.array_equal(own.key0, points)
    assert np.array_equal(own.faces, faces)
    whole = qc3d.bake([pair.key0, pair.key1], pair.faces, 1, mirror="none").frames[1]
    half = qc3d.bake([points, later], faces, 1).frames[1]
    assert np.abs(whole[: len(half)] - half).max() < 1e-3
    assert pair.own.polygons.shape == (len(faces),)
    assert len(np.unique(pair.polygons)) == 2 * len(np.unique(own.polygons))


def test_vertices_within_reach_of_the_plane_stay_within() -> None:
    points, faces = halved((0,))
    seam = points[:, 0] == 0.0
    near, later = points.copy(), swung(points, (0,))
    near[seam, 0], later[seam, 0] = 2e-4, -3e-4
    plane = MirrorPlane.across(0, 5e-4)
    pairs = consecutive_pairs({"a": near, "b": later}, faces, None, ("a", "b"), None, [plane])
    pair = pairs["a", "b"]
    assert np.array_equal(on_plane(pair.key0, pair.key1, len(points), 0), seam)
    bake = qc3d.steps.Work(_frames(pairs)).run()
    wanted = (1.0 - bake.times) * 2e-4 + bake.times * -3e-4
    assert np.abs(bake.frames[:, seam, 0] - wanted[:, None]).max() < 1e-12


def _frames(pairs: dict[Ends, KeyPair]) -> Steps[Bake]:
    outcome = yield from carry_out(Task(pairs, ("a", "b"), times=np.linspace(0.0, 1.0, 4)))
    assert outcome.bake is not None
    return outcome.bake


def test_a_plane_anywhere() -> None:
    points, faces = halved((0,))
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    normal = tuple((turn @ [1.0, 0.0, 0.0]).tolist())
    later = swung(points, (0,))
    there = [shape @ turn.T + 0.3 for shape in (points, later)]
    plane = MirrorPlane(normal, normal, 0.3 * sum(normal), 1e-6)  # type: ignore[arg-type]
    pair = consecutive_pairs({"a": there[0], "b": there[1]}, faces, None, ("a", "b"), None, [plane])["a", "b"]
    assert len(pair.welding[0]) == 2 * len(points) - (points[:, 0] == 0.0).sum()
    bake = qc3d.steps.Work(_frames({("a", "b"): pair})).run()
    seam = points[:, 0] == 0.0
    for frame in bake.frames:
        assert np.abs(plane.heights(frame[seam])).max() < 1e-9


def test_a_chain_of_halves() -> None:
    points, faces = halved((0,))
    keys = [points, swung(points, (0,)), points * [1.0, 1.2, 0.8]]
    bake = qc3d.bake(keys, faces, 1)
    assert all(np.array_equal(bake.frames[2 * number], key) for number, key in enumerate(keys))
    assert not bake.frames[:, points[:, 0] == 0.0, 0].any()
    for first, second in itertools.pairwise(bake.frames):
        assert np.abs(first - second).max() < 2.0


def test_a_fit_of_a_half_is_kept(tmp_path: Path) -> None:
    points, faces = halved((0,))
    later = swung(points, (0,))
    fit = qc3d.fit(points, later, faces)
    frames = fit.inbetweens(1).frames
    assert frames.shape == (3, *points.shape)
    fit.save(tmp_path / "half.qc3dmap")
    again = qc3d.load_fit(tmp_path / "half.qc3dmap", points, later, faces)
    assert np.abs(again.inbetweens(1).frames - frames).max() < 1e-9
