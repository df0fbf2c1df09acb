# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A child process that stays: it does one job after the other, keeps all promises of one that does not, and ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError, QC3DError, WorkerError
from qc3d_addon.solver.frames.many import Run
from qc3d_addon.solver.frames.task import Outcome, Task
from qc3d_addon.solver.support import memory
from qc3d_addon.worker import client, standby
from qc3d_addon.worker.client import Limits, Worker
from qc3d_addon.worker.standby import Standby

from .test_client import DONE, KEYS, PATIENCE, is_alive, play, small_task, stand_in, temporary, wait_until_gone

__all__ = ["stand_in", "temporary"]

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")

# The loop of a child that stays.
FOR_EACH_JOB = "for number, line in enumerate(sys.stdin):"


@pytest.fixture
def kept(temporary: Path) -> Iterator[Standby]:
    with_child = Standby()
    yield with_child
    with_child.close()
    assert list(temporary.iterdir()) == []


def pid(of: Standby) -> int:
    assert of._child is not None
    return of._child.process.pid


def frames(outcome: Outcome) -> np.ndarray:
    assert outcome.bake is not None
    return outcome.bake.frames


def exists(process: int) -> bool:
    """Whether there is such a process, were it a zombie."""
    return Path(f"/proc/{process}").exists()


def test_the_next_job_is_done_by_the_same_process_and_gives_the_same(kept: Standby) -> None:
    first = client.run(small_task(), None, None, kept)
    process = pid(kept)
    again = client.run(small_task(), None, None, kept)
    from_map = client.run(replace(small_task(), kept=first.fits), None, None, kept)
    assert pid(kept) == process
    for found in (again, from_map):
        np.testing.assert_array_equal(frames(found), frames(first))
        assert found.fits == first.fits
    runs = client.run(Run.of([small_task(), small_task()]), None, None, kept)
    assert pid(kept) == process
    assert [type(outcome) for outcome in runs] == [Outcome, Outcome]


def test_a_peak_can_be_forgotten() -> None:
    """So that each job tells its own."""
    large = np.ones(25_000_000)
    peak = memory.peak_memory_mb()
    del large
    memory.forget_peak()
    now = memory.peak_memory_mb()
    assert peak is not None
    assert now is not None
    assert now < peak - 100.0


def test_a_peak_that_cannot_be_forgotten_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on macOS, which goes on telling the peak of earlier work."""
    monkeypatch.setattr(memory, "_told_peak_mb", lambda: 300.0)
    monkeypatch.setattr(memory, "_forgotten", 0.0)
    assert memory.peak_memory_mb() == 300.0
    monkeypatch.setattr(memory, "_forgotten", 300.0)
    assert memory.peak_memory_mb() is None
    monkeypatch.setattr(memory, "_told_peak_mb", lambda: 301.0)
    assert memory.peak_memory_mb() == 301.0


def test_one_that_was_started_ahead_does_the_first_job(kept: Standby) -> None:
    kept.prepare()
    process = pid(kept)
    kept.prepare()
    assert pid(kept) == process
    client.run(small_task(), None, None, kept)
    assert pid(kept) == process


def test_an_error_of_the_job_is_no_reason_to_end(kept: Standby) -> None:
    pair = small_task().pairs[KEYS]
    shapes = {"Basis": pair.key0, "Bent": pair.key0 * [1.0, 1.0, -1.0]}
    with pytest.raises(InputError, match="mirrored or turned inside out"):
        client.run(Task.of_keys(shapes, pair.faces, None, KEYS, times=[0.5]), None, None, kept)
    process = pid(kept)
    client.run(small_task(), None, None, kept)
    assert pid(kept) == process


def test_a_cancel_ends_it_at_once(kept: Standby, temporary: Path) -> None:
    client.run(small_task(), None, None, kept)
    process = pid(kept)
    worker = Worker(small_task("finest"), None, kept)
    while worker.progress is None:
        assert worker.poll() is None
        time.sleep(0.01)
    worker.close()
    assert not exists(process)
    assert list(temporary.iterdir()) == []
    client.run(small_task(), None, None, kept)
    assert pid(kept) != process


def test_killed_during_a_job(kept: Standby) -> None:
    client.run(small_task(), None, None, kept)
    worker = Worker(small_task("finest"), None, kept)
    os.kill(worker._process.pid, signal.SIGKILL)
    worker._process.wait()
    with pytest.raises(WorkerError, match="SIGKILL"):
        worker.poll()
    assert client.run(small_task(), None, None, kept).bake is not None


def test_killed_between_jobs(kept: Standby) -> None:
    client.run(small_task(), None, None, kept)
    process = pid(kept)
    os.kill(process, signal.SIGKILL)
    end = time.monotonic() + PATIENCE
    while exists(process):  # without anybody asking for it, it is no zombie either
        assert time.monotonic() < end
        time.sleep(0.01)
    assert client.run(small_task(), None, None, kept).bake is not None
    assert pid(kept) != process


def test_it_ends_by_itself_when_nothing_comes(temporary: Path) -> None:
    with_child = Standby(stay=1.0)
    client.run(small_task(), None, None, with_child)
    process = pid(with_child)
    assert is_alive(process)
    end = time.monotonic() + PATIENCE
    while exists(process):
        assert time.monotonic() < end
        time.sleep(0.05)
    assert list(temporary.iterdir()) == []
    assert client.run(small_task(), None, None, with_child).bake is not None
    assert pid(with_child) != process
    with_child.close()
    assert list(temporary.iterdir()) == []


def test_one_that_is_about_to_end_is_not_asked(kept: Standby, monkeypatch: pytest.MonkeyPatch) -> None:
    client.run(small_task(), None, None, kept)
    process = pid(kept)
    assert kept._child is not None
    kept._child.idle_since -= standby.STAY - 5.0
    client.run(small_task(), None, None, kept)
    assert pid(kept) != process
    assert not exists(process)


def test_one_from_before_an_update_is_not_asked(kept: Standby, monkeypatch: pytest.MonkeyPatch) -> None:
    client.run(small_task(), None, None, kept)
    process = pid(kept)
    monkeypatch.setattr(standby, "code_now", lambda: frozenset({("solver/new.py", 1, 1)}))
    client.run(small_task(), None, None, kept)
    assert pid(kept) != process
    assert not exists(process)


def test_each_has_its_own(kept: Standby) -> None:
    other = Standby()
    for each in (kept, other):
        client.run(small_task(), None, None, each)
    assert pid(kept) != pid(other)
    other.close()
    assert is_alive(pid(kept))


@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM])
def test_it_ends_with_the_process_that_started_it(temporary: Path, repository: Path, ending: int) -> None:
    program = (
        "import time\n"
        "from tests.worker.test_client import small_task\n"
        "from qc3d_addon.worker import client, standby\n"
        "kept = standby.Standby()\n"
        "client.run(small_task(), None, None, kept)\n"
        "print(kept._child.process.pid, flush=True)\n"
        "time.sleep(600)\n"
    )
    environment = {**os.environ, "TMPDIR": str(temporary)}
    with subprocess.Popen(
        [sys.executable, "-c", program], cwd=repository, env=environment, stdout=subprocess.PIPE, text=True
    ) as waiting:
        assert waiting.stdout is not None
        process = int(waiting.stdout.readline())
        assert is_alive(process)
        waiting.send_signal(ending)
    wait_until_gone(process)
    assert list(temporary.iterdir()) == []


def test_each_job_has_its_own_memory_limit(kept: Standby, monkeypatch: pytest.MonkeyPatch) -> None:
    client.run(small_task(), None, Limits(memory_mb=400), kept)
    process = pid(kept)
    client.run(small_task(), None, None, kept)
    assert pid(kept) == process
    monkeypatch.setattr(Task, "require_memory", lambda *_: None)
    with pytest.raises(WorkerError, match="not enough memory within its limit of 4 MB"):
        client.run(small_task("finest"), None, Limits(memory_mb=4), kept)
    assert not exists(process)  # where memory has run out, anything may be broken
    client.run(small_task(), None, None, kept)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([f"    if number: os._exit(3)\n    {DONE}"], "exit status 3"),
        ([f"    if number: os.abort()\n    {DONE}"], "SIGABRT"),
        ([f"    say('7') if number else {DONE}"], "sent invalid data"),
        ([f"    if number: 1 / 0\n    print('Earlier.', file=sys.stderr)\n    {DONE}"], "ZeroDivisionError"),
        ([f"    if number: os._exit(3)\n    print('Earlier.', file=sys.stderr, flush=True)\n    {DONE}"], "status 3"),
        (["    say('{\"error\": [\"MemoryError\", \"\"]}')"], "not enough memory"),
        (["    say('{\"error\": [\"WorkerError\", \"No disk.\"]}')"], "No disk."),
    ],
)
def test_whatever_it_says_the_second_time(
    stand_in: Path, kept: Standby, monkeypatch: pytest.MonkeyPatch, lines: list[str], said: str
) -> None:
    monkeypatch.setattr(client, "read_outcome", lambda *_: Outcome({}, None))
    play(stand_in, FOR_EACH_JOB, *lines)
    errors = []
    for _ in range(2):
        try:
            client.run(small_task(), None, None, kept)
        except QC3DError as error:
            errors.append(str(error))
    assert errors
    assert all(said in error and "Earlier." not in error for error in errors)
    assert kept._child is None


@pytest.mark.parametrize("late", ["say('7')", DONE, "os._exit(0)"])
def test_what_it_does_after_its_job_spoils_no_other(
    stand_in: Path, kept: Standby, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, late: str
) -> None:
    monkeypatch.setattr(client, "read_outcome", lambda *_: Outcome({}, None))
    go_on = tmp_path / "go_on"
    play(
        stand_in,
        FOR_EACH_JOB,
        f"    {DONE}",
        f"    while not os.path.exists({str(go_on)!r}): time.sleep(0.01)",
        f"    {late}",
    )
    processes = set()
    for _ in range(2):
        client.run(small_task(), None, None, kept)
        child = kept._child
        assert child is not None
        processes.add(child.process.pid)
        go_on.touch()
        end = time.monotonic() + PATIENCE
        while not child.inbox.is_garbled and child.process.poll() is None:
            assert time.monotonic() < end
            time.sleep(0.01)
        go_on.unlink()
    assert len(processes) == 2
    assert sum(map(exists, processes)) <= 1


def test_one_that_hangs_is_stopped_after_its_time(stand_in: Path, kept: Standby) -> None:
    play(stand_in, FOR_EACH_JOB, "    time.sleep(600)")
    with pytest.raises(WorkerError, match="time limit of 1 s"):
        client.run(small_task(), None, Limits(seconds=1.0), kept)
    assert kept._child is None
