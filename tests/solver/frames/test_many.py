# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many keys in one run: each as in a bake of its own, what they share made once, and failures kept apart."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.errors import InputError, MeshingError
from qc3d_addon.solver.fit import volume
from qc3d_addon.solver.fit.storage import from_bytes
from qc3d_addon.solver.frames import many
from qc3d_addon.solver.frames.many import Ended, Run
from qc3d_addon.solver.frames.task import Outcome, Task, carry_out
from qc3d_addon.solver.settings import FitOptions, FrameOptions
from qc3d_addon.solver.support import threads
from qc3d_addon.solver.support.progress import Done, finish

from ..meshes import box_surface, twisted

POINTS, FACES = box_surface((3, 3, 9), (1.0, 1.0, 3.0))
TIMES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
DIAGONAL = float(np.linalg.norm(np.ptp(POINTS, axis=0)))

pytestmark = pytest.mark.usefixtures("coarse_volume")


def bent(angle: float) -> Floats:
    """The upper half of the bar turned about the axis x; the lower half stays."""
    above = np.maximum(POINTS[:, 2] - POINTS[:, 2].mean(), 0.0)
    turn = angle * above / above.max()
    middle = POINTS.mean(axis=0)
    y, z = (POINTS - middle)[:, 1:].T
    sine, cosine = np.sin(turn), np.cos(turn)
    return np.stack([POINTS[:, 0], cosine * y - sine * z, sine * y + cosine * z], axis=1) + [0.0, *middle[1:]]


KEYS = [bent(0.4), twisted(POINTS, 0.9), bent(-0.5)]


def task_of(key: Floats, **options: object) -> Task:
    shapes = {"Basis": POINTS, "Key": key}
    triangles = np.arange(len(FACES))
    return Task.of_keys(
        shapes, FACES, None, ("Basis", "Key"), FitOptions(**options), times=TIMES, polygons=triangles
    )


def frames_of(outcome: object) -> Floats:
    assert isinstance(outcome, Outcome), outcome
    assert outcome.bake is not None
    return outcome.bake.frames


@pytest.fixture
def fillings(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How often the cube was filled: the number of points of each time."""
    filled: list[int] = []
    fill_cube = volume.fill_cube

    def counted(points: Floats, *arguments: object, **named: object) -> object:
        filled.append(len(points))
        return fill_cube(points, *arguments, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(volume, "fill_cube", counted)
    return filled


@pytest.mark.parametrize("cores", [1, 2])
def test_each_key_is_as_in_a_bake_of_its_own(
    fillings: list[int], monkeypatch: pytest.MonkeyPatch, cores: int
) -> None:
    monkeypatch.setattr(many, "thread_count", lambda: cores)
    run = Run.of([task_of(key) for key in KEYS])
    assert run.at_once == cores
    together = [frames_of(outcome) for outcome in run.outcomes()]
    assert len(fillings) == 1
    alone = [frames_of(finish(carry_out(task_of(key)))) for key in KEYS]
    other = [frames_of(finish(carry_out(task_of(key, seed=1)))) for key in KEYS]
    for key, found, expected, seeded in zip(KEYS, together, alone, other, strict=True):
        np.testing.assert_array_equal(found[[0, -1]], [POINTS, key])
        apart = np.linalg.norm(found - expected, axis=2).max()
        assert apart <= 2.0 * np.linalg.norm(seeded - expected, axis=2).max() + 1e-5 * DIAGONAL


def test_a_key_does_not_depend_on_the_others_or_on_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    first = [frames_of(outcome) for outcome in Run.of([task_of(key) for key in KEYS]).outcomes()]
    monkeypatch.setattr(many, "thread_count", lambda: 1)
    second = [frames_of(outcome) for outcome in Run.of([task_of(key) for key in KEYS[1::-1]]).outcomes()]
    np.testing.assert_array_equal(first[0], second[1])
    np.testing.assert_array_equal(first[1], second[0])


def test_a_key_that_leaves_the_shared_cube_has_its_own(fillings: list[int]) -> None:
    far = POINTS + [[0.0, 0.0, 1.0]] * np.maximum(POINTS[:, 2:] - 0.2, 0.0)  # twice as long
    found = Run.of([task_of(key) for key in (*KEYS[:2], far)]).outcomes()
    assert len(fillings) == 2
    np.testing.assert_array_equal(frames_of(found[2]), frames_of(finish(carry_out(task_of(far)))))


def test_a_single_key_is_baked_as_ever() -> None:
    (found,) = Run.of([task_of(KEYS[0])]).outcomes()
    np.testing.assert_array_equal(frames_of(found), frames_of(finish(carry_out(task_of(KEYS[0])))))


def test_the_stored_fit_gives_the_same_frames() -> None:
    tasks = [task_of(key) for key in KEYS[:2]]
    outcome = Run.of(tasks).outcomes()[0]
    assert isinstance(outcome, Outcome)
    pair = next(iter(tasks[0].pairs.values()))
    assert from_bytes(next(iter(outcome.fits.values())), pair).volume.cube is not None
    again = finish(carry_out(replace(tasks[0], kept=outcome.fits)))
    np.testing.assert_allclose(frames_of(again), frames_of(outcome), rtol=0.0, atol=1e-12)


def test_a_key_that_fails_leaves_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    inside_out = POINTS * [1.0, 1.0, -1.0]
    found = Run.of([task_of(KEYS[0]), task_of(inside_out), task_of(KEYS[1])]).outcomes()
    assert [type(outcome) for outcome in found] == [Outcome, InputError, Outcome]
    assert "mirrored or turned inside out" in str(found[1])


def test_where_the_cube_cannot_be_filled_each_key_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise MeshingError("No mesh.")

    monkeypatch.setattr(volume, "fill_cube", fails)
    found = Run.of([task_of(key) for key in KEYS]).outcomes()
    assert [(type(outcome), str(outcome)) for outcome in found] == [(MeshingError, "No mesh.")] * 3


def test_an_error_that_is_a_bug_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(many, "carry_out", broken)
    with pytest.raises(ZeroDivisionError):
        Run.of([task_of(key) for key in KEYS]).outcomes()


def test_progress_and_results_come_on_the_way_and_leaving_stops_all() -> None:
    steps = Run.of([task_of(key) for key in KEYS]).carried_out()
    seen = []
    for step in steps:
        seen.append(step)
        if isinstance(step, Ended):
            break
    steps.close()
    assert threading.active_count() == 1 or not any("ThreadPool" in one.name for one in threading.enumerate())
    progress = [step for step in seen if isinstance(step, Done)]
    parts = [step.overall for step in progress]
    assert parts == sorted(parts)
    assert 0.0 == parts[0] < parts[-1] < 1.0
    assert {(step.ended, step.tasks, step.label) for step in progress} == {(0, 3, "0 of 3 keys done")}


def test_arrays_of_the_base_are_held_once_and_straight_keys_need_no_volume(fillings: list[int]) -> None:
    run = Run.of([replace(task_of(key), frame_options=FrameOptions("straight")) for key in KEYS])
    for name in ("key0", "faces", "edges", "polygons"):
        assert len({id(getattr(pair, name)) for task in run.tasks for pair in task.pairs.values()}) == 1
    assert [type(outcome) for outcome in run.outcomes()] == [Outcome] * 3
    assert not fillings


def test_memory_decides_how_many_run_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many, "thread_count", lambda: 2)
    tasks = [task_of(key) for key in KEYS]
    needed = tasks[0].estimated_mb
    assert [Run.of(tasks, factor * needed).at_once for factor in (1.1, 1.6)] == [1, 2]
    with pytest.raises(InputError, match="needs about"):
        Run.of(tasks).require_memory(0.5 * needed)
    monkeypatch.setattr(many, "_SMALL", 10)
    assert Run.of(tasks).at_once == 1


def test_a_thread_that_is_alone_starts_no_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads.os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    assert threads.thread_count() == 2
    own = threading.get_ident()
    with threads.alone():
        assert threads.thread_count() == 1
        with threads.beside(threading.get_ident) as other:
            assert other.result() == own
        assert set(threads.in_threads(lambda _: threading.get_ident(), range(3))) == {own}
    assert threads.thread_count() == 2


class TestForScripts:
    def test_keys_as_they_end(self) -> None:
        seen: list[Done] = []
        found = dict(qc3d.bake_keys(POINTS, [KEYS[0], POINTS[:3], KEYS[1]], FACES, 1, progress=seen.append))
        assert sorted(found) == [0, 1, 2]
        assert isinstance(found[1], InputError)
        for number, key in ((0, KEYS[0]), (2, KEYS[1])):
            np.testing.assert_array_equal(found[number].frames[[0, -1]], [POINTS, key])
        assert seen[-1] == Done(2, 2, 1.0)

    def test_options_that_cannot_be(self) -> None:
        with pytest.raises(InputError):
            list(qc3d.bake_keys(POINTS, KEYS, FACES, -1))
        assert list(qc3d.bake_keys(POINTS, [], FACES)) == []
