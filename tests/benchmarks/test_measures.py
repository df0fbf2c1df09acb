# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark's measures: known answers, and agreement with an independent judge where there is one."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from benchmarks import measures

TIMES = np.linspace(0.0, 1.0, 5)


@pytest.fixture(scope="session")
def judge(repository: Path) -> ModuleType:
    """An independent implementation of the same measures."""
    path = Path(os.environ.get("QC3D_JUDGE", repository / "../shared/bench/inbetween_metrics.py")).resolve()
    if not path.is_file():
        pytest.skip(f"there is no independent judge at {path} (set QC3D_JUDGE)")
    spec = importlib.util.spec_from_file_location("independent_judge", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def tetrahedron(offset: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Corner of a unit cube, volume 1/6, normals out."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) + offset
    return points, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def straight(key0: np.ndarray, key1: np.ndarray, times: np.ndarray = TIMES) -> np.ndarray:
    return np.stack([(1.0 - t) * key0 + t * key1 for t in times])


def assert_same(ours: object, theirs: object) -> None:
    if isinstance(theirs, dict):
        assert isinstance(ours, dict)
        assert ours.keys() == theirs.keys()
        for name in theirs:
            assert_same(ours[name], theirs[name])
    elif isinstance(theirs, list):
        assert isinstance(ours, list)
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs, strict=True):
            assert_same(one, other)
    else:
        assert ours == (None if theirs is None else pytest.approx(theirs, rel=1e-9, abs=1e-14))


def test_agrees_with_the_independent_judge_on_noise(judge: ModuleType, bar: dict[str, np.ndarray]) -> None:
    random = np.random.default_rng(1)
    frames = straight(bar["V0"], bar["V1"])
    frames[1:-1] += random.normal(scale=0.3, size=frames[1:-1].shape)
    ours = measures.measure(bar["faces"], frames, TIMES, bar["V0"], bar["V1"])
    assert_same(ours, judge.measure(bar["faces"], frames, TIMES, (bar["V0"], bar["V1"])))
    assert ours["worst"]["intersections"] > 0


def test_agrees_with_the_independent_judge_on_an_open_mesh_and_missed_keys(
    judge: ModuleType, bar: dict[str, np.ndarray]
) -> None:
    frames = straight(bar["V0"], bar["V1"]) + 1e-3
    faces = bar["faces"][1:]
    ours = measures.measure(faces, frames, TIMES, bar["V0"], bar["V1"])
    assert_same(ours, judge.measure(faces, frames, TIMES, (bar["V0"], bar["V1"])))
    assert ours["worst"]["volume_dev"] is None
    assert ours["key_error"] > 0.0
    assert ours["worst"]["still_drift"] > 0.0


@pytest.mark.parametrize(("file", "second"), [("fox", 2), ("bar", 2), ("head_parts", 1)])
def test_agrees_with_the_independent_judge_on_real_meshes(
    judge: ModuleType, data_folder: Path, file: str, second: int
) -> None:
    with np.load(data_folder / f"{file}.npz", allow_pickle=False) as stored:
        faces, key0, key1 = stored["faces"], stored["V0"].astype(float), stored[f"V{second}"].astype(float)
    frames = straight(key0, key1)
    assert_same(measures.measure(faces, frames, TIMES, key0, key1), judge.measure(faces, frames, TIMES, (key0, key1)))


def test_excess_is_the_relative_distance_from_the_interval() -> None:
    values = np.array([1.0, 1.5, 2.0, 0.5, 3.0, 0.0])
    first, second = np.full(6, 1.0), np.full(6, 2.0)
    assert measures.excess(values, first, second, 1e-3).tolist() == [0.0, 0.0, 0.0, 0.5, 0.5, 1.0]
    assert measures.excess(values, second, first, 1e-3).tolist() == [0.0, 0.0, 0.0, 0.5, 0.5, 1.0]


def test_excess_of_a_vanishing_edge_is_bounded_by_the_floor() -> None:
    assert measures.excess(np.array([0.1]), np.zeros(1), np.zeros(1), 0.1).tolist() == [1.0]


def test_half_turn_collapses_a_straight_blend_completely() -> None:
    points, faces = tetrahedron(-0.25)
    turned = points * (-1.0, -1.0, 1.0)
    row = measures.Judge(faces, points, turned, crossings=False).frame((points + turned) / 2.0, 0.5)
    flat = np.array([[0.0, 0.0, -0.25]] * 3 + [[0.0, 0.0, 0.75]])
    assert np.allclose((points + turned) / 2.0, flat)
    assert row["edge_excess_p99"] == pytest.approx(1.0)  # the base's edges have no length left
    assert row["edge_excess_mean"] == pytest.approx((3.0 + 2.0 * (1.0 - np.sqrt(0.5))) / 6.0)
    assert row["area_excess_mean"] == pytest.approx(1.0)
    assert row["volume_dev"] == pytest.approx(1.0)
    assert row["arc"] == 0.0


def test_volume_of_a_tetrahedron_anywhere() -> None:
    for offset in (0.0, 10.0):
        assert measures.enclosed_volume(*tetrahedron(offset)) == pytest.approx(1.0 / 6.0)


def test_volume_counts_closed_components_only() -> None:
    faces = tetrahedron()[1]
    both = np.concatenate([faces, faces[1:] + 4])
    assert measures.closed_triangles(both).tolist() == [True] * 4 + [False] * 3


def test_uniform_growth_stays_between_the_keys() -> None:
    points, faces = tetrahedron()
    result = measures.measure(faces, straight(points, 2.0 * points), TIMES, points, 2.0 * points)
    assert result["worst"]["edge_excess_p99"] == 0.0
    assert result["worst"]["area_excess_mean"] == 0.0
    assert result["worst"]["volume_dev"] == pytest.approx(1.0 - 1.25**3 / 2.75)  # at a quarter
    assert result["worst"]["arc"] == 0.0
    assert result["jerk"] == pytest.approx(0.0, abs=1e-12)


def test_still_drift_sees_only_vertices_that_both_keys_leave() -> None:
    points, faces = tetrahedron()
    moved = points.copy()
    moved[3, 2] = 2.0
    judge = measures.Judge(faces, points, moved, crossings=False)
    frame = 0.5 * (points + moved)
    frame[0, 0] -= 0.1
    assert judge.frame(frame, 0.5)["still_drift"] == pytest.approx(0.1 / np.sqrt(3.0))
    assert measures.Judge(faces, points, points + 1.0, crossings=False).frame(points, 0.5)["still_drift"] is None


def test_crossings_beyond_those_of_the_keys() -> None:
    points, faces = tetrahedron()
    apart = np.concatenate([points, points + 5.0])
    together = np.concatenate([points, points + 0.2])
    two = np.concatenate([faces, faces + 4])
    crossings = measures.count_crossings(together, two)
    if crossings is None:
        pytest.skip("Blender's module is not installed")
    assert crossings > 0
    assert measures.count_crossings(apart, two) == 0
    assert measures.Judge(two, apart, apart + 1.0).frame(together, 0.5)["intersections"] == crossings
    assert measures.Judge(two, apart, together).frame(together, 0.5)["intersections"] == 0


def test_jerk_of_a_jump_and_of_a_steady_motion() -> None:
    steady = np.arange(5.0)[:, None, None] * np.ones((1, 3, 3))
    assert measures.jerk(steady) == 0.0
    jump = np.array([0.0, 0.0, 1.0, 1.0])[:, None, None] * np.array([1.0, 0.0, 0.0])
    assert measures.jerk(jump) == pytest.approx(1.0)
    assert measures.jerk(steady[:2]) == 0.0
