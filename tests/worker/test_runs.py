# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many tasks in one child process: each has its own outcome or error, and what is done is never lost."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.combinations.corrections import Corrections
from qc3d_addon.solver.errors import InputError, QC3DError, WorkerError
from qc3d_addon.solver.frames.many import Run
from qc3d_addon.solver.frames.task import Outcome, Task
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import Done, Progress, finish
from qc3d_addon.worker import client
from qc3d_addon.worker.client import Limits, Worker

from ..solver.combinations.arm import arm, posed
from .test_client import DONE, KEYS, is_alive, play, small_task, stand_in, temporary

__all__ = ["stand_in", "temporary"]

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")

NEVER = InputError("It was not reached.")


def inside_out() -> Task:
    pair = small_task().pairs[KEYS]
    shapes = {"Basis": pair.key0, "Bent": pair.key0 * [1.0, 1.0, -1.0]}
    return Task.of_keys(shapes, pair.faces, None, KEYS, times=[0.0, 0.5, 1.0])


def run_of(*tasks: Task) -> Run:
    return Run.of(list(tasks))


def kinds(outcomes: list[Outcome | QC3DError]) -> list[type]:
    return [type(outcome) for outcome in outcomes]


def test_each_task_has_its_outcome(temporary: Path) -> None:
    seen: list[Done] = []
    run = run_of(small_task(), inside_out(), small_task("fine"))
    found = client.run(run, seen.append)
    assert kinds(found) == [Outcome, InputError, Outcome]
    assert "mirrored or turned inside out" in str(found[1])
    for outcome, expected in zip(found[::2], run.outcomes()[::2], strict=True):
        assert isinstance(outcome, Outcome)
        assert isinstance(expected, Outcome)
        assert outcome.bake is not None
        assert expected.bake is not None
        np.testing.assert_array_equal(outcome.bake.frames, expected.bake.frames)
        assert outcome.fits == expected.fits
    assert seen
    assert all(isinstance(step, Done) and step.tasks == 3 for step in seen)
    assert list(temporary.iterdir()) == []


def test_none_at_all(temporary: Path) -> None:
    assert client.run(run_of()) == []
    assert list(temporary.iterdir()) == []


def test_what_is_done_stays_when_the_rest_is_canceled(temporary: Path) -> None:
    worker = Worker(run_of(small_task(), small_task("finest"), small_task("finest")))
    while all(outcome is NEVER for outcome in worker.outcomes(NEVER)):
        assert worker.poll() is None
        time.sleep(0.01)
    worker.close()
    found = worker.outcomes(NEVER)
    assert NEVER in found
    assert Outcome in kinds(found)
    assert not is_alive(worker._process.pid)
    assert list(temporary.iterdir()) == []


def test_what_is_done_stays_when_the_process_is_killed(temporary: Path) -> None:
    worker = Worker(run_of(small_task(), small_task("finest"), small_task("finest")))
    while all(outcome is NEVER for outcome in worker.outcomes(NEVER)):
        assert worker.poll() is None
        time.sleep(0.01)
    os.kill(worker._process.pid, signal.SIGKILL)
    worker._process.wait()
    found = worker.poll()
    assert found is not None
    assert Outcome in kinds(found)
    errors = [outcome for outcome in found if isinstance(outcome, QC3DError)]
    assert errors
    assert all(isinstance(error, WorkerError) and "SIGKILL" in str(error) for error in errors)
    worker.close()
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["os._exit(3)"], "exit status 3"),
        (["say('{\"ended\": [2]}')", DONE], "sent invalid data"),
        (["say('{\"ended\": [-1]}')", DONE], "sent invalid data"),
        (["say('{\"ended\": [true]}')", DONE], "sent invalid data"),
        (["say('{\"ended\": [0, \"InputError\"]}')", DONE], "sent invalid data"),
        (["say('{\"run\": [3, 2, 0.5]}')", DONE], "sent invalid data"),
        (["say('{\"run\": [1, 2, NaN]}')", DONE], "sent invalid data"),
        (["say('{\"run\": [1, 2]}')", DONE], "sent invalid data"),
        (["say('{\"ended\": [0]}')", "say('{\"ended\": [1]}')", DONE], "cannot be read"),
        ([DONE], "sent invalid data"),
        (["say('{\"error\": [\"MeshingError\", \"No.\"]}')"], "No."),
    ],
)
def test_whatever_the_child_says(stand_in: Path, temporary: Path, lines: list[str], said: str) -> None:
    play(stand_in, *lines)
    found = client.run(run_of(small_task(), small_task()))
    assert len(found) == 2
    assert all(isinstance(outcome, QC3DError) and said in str(outcome) for outcome in found)
    assert list(temporary.iterdir()) == []


def test_a_single_task_has_no_parts_that_end(stand_in: Path, temporary: Path) -> None:
    play(stand_in, "say('{\"ended\": [0]}')", "time.sleep(600)")
    with pytest.raises(WorkerError, match="sent invalid data"):
        client.run(small_task())
    assert list(temporary.iterdir()) == []


def test_each_task_has_its_time(stand_in: Path, temporary: Path) -> None:
    play(stand_in, "time.sleep(600)")
    found = client.run(run_of(small_task(), small_task()), None, Limits(seconds=0.5))
    assert all("time limit of 1 s" in str(outcome) for outcome in found)


def test_common_arrays_are_written_once(temporary: Path) -> None:
    worker = Worker(run_of(small_task(), small_task("fine")))
    folder = next(temporary.iterdir())
    with np.load(folder / "job" / "task1" / "pair0.npz") as stored:
        assert stored.files == ["key1", "edges"] or stored.files == ["key1"]
    worker.close()


class TestCorrections:
    """Keys that are on at once."""

    @staticmethod
    def wanted() -> Corrections:
        rest, faces = arm()
        keys = [posed(rest, 0.0, 60.0, (0.0, 1.0, 0.0)), posed(rest, 50.0, 0.0)]
        alone = np.stack([[rest + 0.5 * (key - rest), key] for key in keys])
        places = np.array([[0, 1], [1, 1]])
        both = rest + sum(key - rest for key in keys)
        edges = np.empty((0, 2), dtype=np.int64)
        return Corrections(rest, alone, both, places, np.array([0.5, 1.0]), faces, edges, True, FitOptions())

    def test_the_child_makes_what_this_process_would(self, temporary: Path) -> None:
        seen: list[Progress] = []
        found, expected = client.run(self.wanted(), seen.append), finish(self.wanted().carried_out())
        np.testing.assert_array_equal(found.shapes, expected.shapes)
        for name in ("order", "crossings", "off", "is_sculpted"):
            assert getattr(found, name) == getattr(expected, name)
        assert found.order == (1, 0)
        assert seen[-1].overall == 1.0
        assert list(temporary.iterdir()) == []

    def test_errors_are_those_of_the_work(self, temporary: Path) -> None:
        wanted = self.wanted()
        with pytest.raises(InputError, match="not finite"):
            client.run(replace(wanted, alone=np.where(wanted.alone > 1.0, np.nan, wanted.alone)))
        with pytest.raises(InputError, match=r"needs about .* limit is 20 MB"):
            client.run(wanted, None, Limits(memory_mb=20))

    def test_a_result_that_is_none(self, stand_in: Path, temporary: Path) -> None:
        play(stand_in, DONE)
        with pytest.raises(WorkerError, match="cannot be read"):
            client.run(self.wanted())
        assert list(temporary.iterdir()) == []
