# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory that a bake needs is known before it starts."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.bake import evenly_spaced
from qc3d_addon.solver.frames.task import Task
from qc3d_addon.solver.support import memory
from qc3d_addon.solver.support.memory import estimated_mb, machine_limit_mb, require_memory

KEYS = ("Basis", "Up")


# Vertices, share of them that move, frames, quality and the megabytes that benchmarks/large.py measured.
@pytest.mark.parametrize(
    ("vertices", "moving", "frames", "quality", "measured"),
    [
        (6890, 0.4, 6, "normal", 118),
        (27554, 0.41, 6, "normal", 229),
        (110210, 0.41, 6, "normal", 585),
        # The limb of benchmarks/stages.py, all of which moves.
        (10000, 1.0, 6, "normal", 158),
        (100000, 1.0, 6, "normal", 664),
        # These two are the peaks of processes that only fitted.
        (3926, 1.0, 0, "exact", 399),
        (6890, 1.0, 0, "exact", 603),
    ],
)
def test_the_estimate_is_within_a_quarter_of_what_was_measured(
    vertices: int, moving: float, frames: int, quality: str, measured: float
) -> None:
    estimate = estimated_mb(vertices, 1, frames, quality, moving=moving)  # type: ignore[arg-type]
    assert abs(estimate - measured) < 0.25 * measured


def test_what_does_not_move_needs_less() -> None:
    points = np.random.default_rng(0).uniform(size=(10_000, 3))
    half = points.copy()
    half[5_000:] += 1.0
    tasks = [
        Task.of_keys({"Basis": points, "Up": other}, [[0, 1, 2]], None, KEYS, times=evenly_spaced(5))
        for other in (half, points + 1.0)
    ]
    assert tasks[0].estimated_mb == pytest.approx(estimated_mb(10_000, 1, 7, "normal", moving=0.5))
    assert tasks[1].estimated_mb == pytest.approx(estimated_mb(10_000, 1, 7, "normal"))


def test_a_hundred_thousand_vertices_need_less_than_4_gb() -> None:
    for quality in ("normal", "fine", "finest"):
        assert estimated_mb(100_000, 1, 22, quality) < 4096.0  # type: ignore[arg-type]


def test_a_million_vertices_are_refused_before_anything_starts() -> None:
    points = np.random.default_rng(0).uniform(size=(1_000_000, 3))
    faces = np.arange(999_999).reshape(-1, 3)
    no_edges = np.empty((0, 2), dtype=np.int64)
    task = Task.of_keys({"Basis": points, "Up": points * 2.0}, faces, no_edges, KEYS, times=evenly_spaced(5))
    with pytest.raises(InputError, match=r"The bake of 1000000 vertices needs about 6\d{3} MB .* its limit is 4096 MB"):
        task.require_memory(4096)
    task.require_memory(12_000)
    task.require_memory(0)  # no limit


def test_more_keys_and_frames_need_more() -> None:
    assert estimated_mb(10**5, 3, 7, "fine") > 2.5 * estimated_mb(10**5, 1, 7, "fine")
    assert estimated_mb(10**5, 1, 1000, "fine") > 10_000.0
    assert estimated_mb(10**5, 1, 7, "fine", needs_maps=False) < 300.0


@pytest.mark.parametrize(
    ("vertices", "frames", "measured"), [(27554, 7, 105), (110210, 7, 213), (110210, 62, 488)]
)
def test_the_estimate_without_maps(vertices: int, frames: int, measured: float) -> None:
    assert measured <= estimated_mb(vertices, 1, frames, "normal", needs_maps=False) <= 2.0 * measured + 60.0


def test_triangles_count_where_they_are_more_than_usual() -> None:
    usual = estimated_mb(10**5, 1, 7, "normal", triangles=2 * 10**5)
    assert usual == estimated_mb(10**5, 1, 7, "normal")
    assert estimated_mb(10**5, 1, 7, "normal", triangles=10**6) > 3.5 * usual
    assert estimated_mb(10, 1, 7, "normal", False, triangles=10**7) > 6000.0


# Vertices, tetrahedra, and the megabytes of analyze, reconstruct and compress.
@pytest.mark.parametrize(
    ("points", "tets", "measured"), [(2197, 10368, 145), (15625, 82944, 286), (68921, 384000, 598)]
)
def test_tetrahedra(points: int, tets: int, measured: float, monkeypatch: pytest.MonkeyPatch) -> None:
    held = 8 * (3 * points + 4 * tets + 6 * tets)
    monkeypatch.setattr(memory, "machine_limit_mb", lambda: measured)
    with pytest.raises(InputError, match=rf"A mesh of {tets} tetrahedra .* three quarters of the machine's are"):
        memory.require_memory_for_tets(points, tets, held)
    monkeypatch.setattr(memory, "machine_limit_mb", lambda: 3.0 * measured)
    memory.require_memory_for_tets(points, tets, held)
    monkeypatch.setattr(memory, "machine_limit_mb", lambda: 0)  # not known
    memory.require_memory_for_tets(points, 10 * tets, held)


@pytest.mark.parametrize(("frames", "vertices", "measured"), [(31, 6890, 132), (31, 27554, 267)])
def test_frames_to_compress(
    frames: int, vertices: int, measured: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "machine_limit_mb", lambda: measured)
    with pytest.raises(InputError, match=rf"Work on {frames} frames of {vertices} vertices needs about"):
        memory.require_memory_for_frames(frames, vertices)
    monkeypatch.setattr(memory, "machine_limit_mb", lambda: 2.0 * measured)
    memory.require_memory_for_frames(frames, vertices)


def test_the_sentence_says_what_to_do() -> None:
    with pytest.raises(InputError, match=r"Raise the limit, use fewer in-betweens or keys, or bake a coarser mesh"):
        require_memory(10.0, 5.0, 3)


@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc/meminfo")
def test_the_machines_limit_is_less_than_its_memory() -> None:
    with open("/proc/meminfo") as file:
        total = int(file.readline().split()[1]) / 1024
    assert 0.5 * total < machine_limit_mb() < total


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="only Linux tells it there")
def test_the_peak_is_that_of_this_process_alone() -> None:
    held = np.ones(50_000_000)  # 400 MB, which a child would be counted with
    code = "from qc3d_addon.solver.support.memory import peak_memory_mb; print(peak_memory_mb())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert held[-1] == 1.0
    assert 5.0 < float(done.stdout) < 300.0


def test_memory_is_given_back_where_that_is_possible(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    class Library:
        def __init__(self, name: object) -> None:
            self.malloc_trim = calls.append

    monkeypatch.setattr(memory.ctypes, "CDLL", Library)
    memory.give_back()
    assert calls == [0]
    monkeypatch.setattr(memory.ctypes, "CDLL", lambda _: object())  # a library without that function
    memory.give_back()
    assert calls == [0]
