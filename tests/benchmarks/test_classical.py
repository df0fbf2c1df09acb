# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The classical methods of the benchmark, and the exact in-betweens of the bar."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks import measures
from benchmarks.catalogue import Pair
from benchmarks.classical import arap, arap_surface, corrective_smooth, interior, poisson, rotational
from benchmarks.classical.gradients import GradientPath, RigidMotion, rotations_nearest
from benchmarks.exact import bent, exact_shape, twisted

TIMES = np.linspace(0.0, 1.0, 5)
METHODS = {"poisson": poisson.frames, "arap": lambda *inputs: arap.frames(*inputs)[0]}


@pytest.mark.parametrize("method", METHODS)
def test_both_keys_are_met(method: str, bar: dict[str, np.ndarray]) -> None:
    frames = METHODS[method](bar["V0"], bar["V1"], bar["faces"], TIMES)
    assert np.abs(frames[0] - bar["V0"]).max() < 1e-10
    assert np.abs(frames[-1] - bar["V1"]).max() < 1e-10


@pytest.mark.parametrize("method", METHODS)
def test_a_rigid_motion_stays_rigid(method: str, bar: dict[str, np.ndarray]) -> None:
    rest, faces = bar["V0"], bar["faces"]
    moved = Rotation.from_euler("xyz", [0.5, -1.0, 2.0]).apply(rest) + (1.0, 2.0, 3.0)
    edges = measures.edge_uses(faces)[0]
    for frame in METHODS[method](rest, moved, faces, TIMES):
        assert np.abs(measures.edge_lengths(frame, edges) - measures.edge_lengths(rest, edges)).max() < 1e-10


@pytest.mark.parametrize("method", METHODS)
def test_a_stretch_is_interpolated_linearly(method: str, bar: dict[str, np.ndarray]) -> None:
    rest = bar["V0"] - bar["V0"].mean(axis=0)
    stretched = rest * (1.0, 1.0, 1.5)
    frames = METHODS[method](rest, stretched, bar["faces"], TIMES)
    assert np.abs(frames - np.stack([(1 - t) * rest + t * stretched for t in TIMES])).max() < 1e-10


@pytest.mark.parametrize("method", METHODS)
def test_a_bend_keeps_lengths_far_better_than_a_straight_blend(method: str, bar: dict[str, np.ndarray]) -> None:
    rest, faces = bar["V0"] - (0.5, 0.5, 2.0), bar["faces"]
    target = bent(rest, np.pi / 2)
    judge = measures.Judge(faces, rest, target, crossings=False)
    straight = judge.sequence(np.stack([(1 - t) * rest + t * target for t in TIMES]), TIMES)["worst"]
    classical = judge.sequence(METHODS[method](rest, target, faces, TIMES), TIMES)["worst"]
    assert classical["edge_excess_p99"] < 0.1 * straight["edge_excess_p99"]
    assert classical["volume_dev"] < 0.1 * straight["volume_dev"]


def test_parts_without_connection_and_loose_vertices_follow(bar: dict[str, np.ndarray]) -> None:
    rest, faces = bar["V0"], bar["faces"]
    two = np.concatenate([rest, rest + 10.0, [[5.0, 5.0, 5.0]]])
    moved = np.concatenate([rest, rest + 12.0, [[6.0, 5.0, 5.0]]])
    both = np.concatenate([faces, faces + len(rest)])
    frames = poisson.frames(two, moved, both, TIMES)
    assert np.abs(frames[0] - two).max() < 1e-10
    assert np.abs(frames[-1] - moved).max() < 1e-10


def test_every_part_of_a_surface_has_handles(bar: dict[str, np.ndarray]) -> None:
    rest, faces = bar["V0"], bar["faces"]
    points = np.concatenate([rest, 0.01 * rest + 10.0])
    both = np.concatenate([faces, faces + len(rest)])
    handles = arap_surface.handles_of(points, both)
    assert np.unique(handles).size == handles.size
    assert np.count_nonzero(handles >= len(rest)) == arap_surface.FEWEST
    np.testing.assert_array_equal(
        arap_surface.handles_of(rest, faces), np.sort(arap_surface.spread(rest, round(0.03 * len(rest))))
    )


def test_the_rotation_nearest_to_a_reflection_is_proper() -> None:
    found = rotations_nearest(np.diag([2.0, 1.0, -0.1])[None])[0]
    assert np.allclose(found, np.eye(3))


def test_gradients_are_interpolated_by_angle_and_linear_stretch() -> None:
    turn, stretch = Rotation.from_rotvec([0.0, 0.0, 1.2]), np.diag([2.0, 1.0, 0.5])
    halfway = GradientPath((turn.as_matrix() @ stretch)[None]).at(0.5)[0]
    expected = Rotation.from_rotvec([0.0, 0.0, 0.6]).as_matrix() @ np.diag([1.5, 1.0, 0.75])
    assert np.allclose(halfway, expected)


def test_rigid_alignment_undoes_a_motion() -> None:
    points = np.random.default_rng(0).normal(size=(20, 3))
    moved = Rotation.from_rotvec([0.3, 2.0, -1.0]).apply(points) + (1.0, -2.0, 0.5)
    motion = RigidMotion.between(points, moved)
    assert np.allclose(motion.undo(moved), points)
    assert np.allclose(motion.apply(points, 1.0), moved)


def test_winding_number_is_one_inside_and_zero_outside(bar: dict[str, np.ndarray]) -> None:
    inside = np.array([[0.5, 0.5, 2.0], [0.9, 0.1, 0.2]])
    outside = np.array([[1.5, 0.5, 2.0], [0.5, 0.5, -0.3]])
    found = interior.winding_numbers(np.concatenate([inside, outside]), bar["V0"], bar["faces"])
    assert np.allclose(found, [1.0, 1.0, 0.0, 0.0], atol=0.05)


def test_winding_number_is_exact_when_no_cell_is_far(bar: dict[str, np.ndarray]) -> None:
    inside = np.array([[0.5, 0.5, 2.0], [0.3, 0.6, 2.5]])
    assert np.allclose(interior.winding_numbers(inside, bar["V0"], bar["faces"], sizes=(1,)), 1.0, atol=1e-12)


def test_interior_tetrahedra_fill_a_bar_and_touch_every_vertex(bar: dict[str, np.ndarray]) -> None:
    points, tetrahedra = interior.fill(bar["V0"], bar["faces"])
    assert np.array_equal(points[: len(bar["V0"])], bar["V0"])
    assert np.isin(np.arange(len(points)), tetrahedra).all()
    corners = points[tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert (volumes > 0.0).all()
    assert volumes.sum() == pytest.approx(4.0, rel=2e-2)  # slivers between points of one plane are left out


@pytest.mark.parametrize("second", ["twist180", "twist270", "twist450", "bend180", "bend300"])
def test_the_formula_of_the_exact_bar_meets_the_keys(data_folder: Path, second: str) -> None:
    with np.load(data_folder / "bar.npz", allow_pickle=False) as stored:
        names = stored["shape_names"].tolist()
        straight, key = stored["V0"].astype(float), stored[f"V{names.index(second)}"].astype(float)
    pair = Pair("bar", "straight", second)
    for time, shape in ((0.0, straight), (1.0, key)):
        found = exact_shape(pair, straight, time)
        assert found is not None
        assert np.abs(found - shape).max() < 1e-6


def test_exact_shapes_are_known_for_the_bar_alone() -> None:
    points = np.zeros((4, 3))
    assert exact_shape(Pair("bar", "twist180", "twist270"), points, 0.5) is None
    assert exact_shape(Pair("body", "straight", "twist60"), points, 0.5) is None


def test_a_twist_keeps_heights_and_a_bend_keeps_the_middle_lines_length() -> None:
    line = np.stack([np.zeros(101), np.zeros(101), np.linspace(-2.0, 2.0, 101)], axis=1)
    assert np.array_equal(twisted(line, 3.0), line)
    arc = bent(line, np.pi)
    assert np.linalg.norm(np.diff(arc, axis=0), axis=1).sum() == pytest.approx(4.0, rel=1e-3)
    assert np.allclose(arc[50], 0.0)
    assert np.linalg.norm(arc[-1] - arc[0]) == pytest.approx(2.0 * 4.0 / np.pi)


def test_arcs_about_the_center_keep_distances_from_it() -> None:
    points = np.random.default_rng(0).normal(size=(20, 3))
    turned = Rotation.from_rotvec([0.0, 0.0, 1.2]).apply(points)
    half = Rotation.from_rotvec([0.0, 0.0, 0.6]).apply([[1.0, 0.0, 0.0]])
    frames = rotational.frames(points, turned, TIMES)
    np.testing.assert_allclose(frames[[0, -1]], [points, turned], rtol=0.0, atol=1e-12)
    lengths = np.linalg.norm(frames, axis=2)
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], lengths.shape), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(
        rotational.frames(np.eye(3)[:1], np.array([[np.cos(1.2), np.sin(1.2), 0.0]]), [0.5])[0], half, atol=1e-12
    )


def test_where_there_is_no_one_arc_vertices_go_straight() -> None:
    first, second = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), np.array(
        [[3.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]
    )
    halfway = rotational.frames(first, second, [0.5])[0]
    np.testing.assert_allclose(halfway, [[2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-12)


def test_corrective_smooth_meets_both_keys_to_single_precision(bar: dict[str, np.ndarray]) -> None:
    frames = corrective_smooth.frames(bar["V0"], bar["V1"], bar["faces"], TIMES)
    np.testing.assert_allclose(frames[[0, -1]], [bar["V0"], bar["V1"]], rtol=0.0, atol=1e-5)
    assert np.abs(frames[2] - 0.5 * (bar["V0"] + bar["V1"])).max() > 1e-3


def test_libigls_morph_meets_both_keys_and_keeps_a_rigid_motion_rigid(bar: dict[str, np.ndarray]) -> None:
    pytest.importorskip("igl")
    frames = arap_surface.frames(bar["V0"], bar["V1"], bar["faces"], TIMES)
    np.testing.assert_allclose(frames[[0, -1]], [bar["V0"], bar["V1"]], rtol=0.0, atol=1e-5)
    moved = Rotation.from_euler("xyz", [0.5, -1.0, 2.0]).apply(bar["V0"]) + (1.0, 2.0, 3.0)
    edges = measures.edge_uses(bar["faces"])[0]
    halfway = arap_surface.frames(bar["V0"], moved, bar["faces"], [0.5])[0]
    assert np.abs(measures.edge_lengths(halfway, edges) - measures.edge_lengths(bar["V0"], edges)).max() < 1e-6
