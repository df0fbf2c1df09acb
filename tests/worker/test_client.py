# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""However the child process ends, there is one typed error with one sentence, and no process or folder is left."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError, MeshingError, QC3DError, WorkerError
from qc3d_addon.solver.frames.bake import evenly_spaced
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import Progress, finish
from qc3d_addon.worker import child, client, exchange, idleness
from qc3d_addon.worker.client import Limits, Worker

from ..solver.meshes import box_surface, twisted

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")

KEYS = ("Basis", "Bent")
PATIENCE = 60.0


def small_task(quality: str = "normal") -> Task:
    points, faces = box_surface((2, 2, 6), (1.0, 1.0, 4.0))
    shapes = {"Basis": points, "Bent": twisted(points, 0.8)}
    options = FitOptions(quality=quality)  # type: ignore[arg-type]
    return Task.of_keys(shapes, faces, None, KEYS, options, times=evenly_spaced(1))


@pytest.fixture
def temporary(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The folder for temporary files, empty at the start and at the end."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, temporary: Path) -> Path:
    """A file that plays the child program."""
    script = tmp_path / "child.py"
    monkeypatch.setattr(child, "CHILD", script)
    return script


def play(script: Path, *lines: str) -> None:
    start = [
        "import ctypes, json, os, signal, subprocess, sys, time",
        "folder = sys.argv[2]",
        "def say(text):",
        "    os.write(1, text.encode() + bytes(1))",
    ]
    script.write_text("\n".join([*start, *lines]), encoding="utf-8")


def failure(limits: Limits | None = None) -> QC3DError:
    with pytest.raises(QC3DError) as caught:
        client.run(small_task(), None, limits)
    assert "\n" not in str(caught.value)
    assert str(caught.value).endswith(".") or "Its last message" in str(caught.value)
    return caught.value


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def wait_until_gone(pid: int) -> None:
    end = time.monotonic() + PATIENCE
    while is_alive(pid):
        assert time.monotonic() < end, f"process {pid} goes on"
        time.sleep(0.01)


DONE = "say('{\"done\": true}')"
MESSAGE_OF_AN_ERROR = "say(json.dumps({'error': %r}))"
GARBAGE = [
    "say('Intel MKL WARNING')",
    "os.write(1, bytes([255, 254]) * 50 + bytes(1))",
    "say('')",
    "say('[' * 100_000)",
    "say('7')",
    "say('[]')",
    "say('{}')",
    "say('\"progress\"')",
    "say('{\"progress\": [\"fit\", NaN]}')",
    "say('{\"progress\": [\"fit\", -1]}')",
    "say('{\"progress\": [\"fit\", 1e999]}')",
    "say('{\"progress\": [\"cooking\", 0.5]}')",
    "say('{\"progress\": [[], 0.5]}')",
    "say('{\"progress\": \"fit\"}')",
    "say('{\"progress\": [\"fit\", \"half\"]}')",
    "say('{\"error\": [\"InputError\"]}')",
    "say('{\"error\": [3, 4]}')",
    "say('{\"done\": false}')",
    "say('{\"done\": true, \"error\": [\"InputError\", \"No.\"]}')",
]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", "was ended by SIGKILL; memory may have run out"),
        ("os.kill(os.getpid(), signal.SIGTERM)", "was ended by SIGTERM"),
        ("os.abort()", "was ended by SIGABRT"),
        ("ctypes.string_at(0)", "was ended by SIGSEGV"),
        ("os._exit(0)", r"ended without a result \(exit status 0\)"),
        ("ctypes.CDLL(None).exit(0)", r"ended without a result \(exit status 0\)"),
        ("sys.exit(3)", r"ended without a result \(exit status 3\)"),
        ("1 / 0", r"exit status 1.*Its last message: ZeroDivisionError"),
        ("import no_such_module", r"exit status 1.*Its last message: ModuleNotFoundError"),
        ("os.write(1, b'{\"done\": tr')", r"ended without a result \(exit status 0\)"),
        (f"{DONE}; os.abort()", "was ended by SIGABRT"),
        (f"{DONE}; os._exit(1)", "exit status 1"),
        (DONE, "The result of the work cannot be read: .*; run it again"),
        ("sys.stderr.write('x' * 10**6); os._exit(1)", "exit status 1"),
    ],
)
def test_each_ending_is_one_error(stand_in: Path, temporary: Path, line: str, said: str) -> None:
    play(stand_in, line)
    error = failure()
    assert type(error) is WorkerError
    assert re.search(said, str(error)), error
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("line", [*GARBAGE, "while True: os.write(1, b'x' * 65536)"])
@pytest.mark.parametrize("after", ["time.sleep(600)", "os._exit(0)"])
def test_garbage_among_the_messages(stand_in: Path, temporary: Path, line: str, after: str) -> None:
    play(stand_in, line, after)
    assert "sent invalid data and was stopped" in str(failure())
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("told", "kind", "said"),
    [
        (["MeshingError", "No mesh."], MeshingError, "No mesh."),
        (["InputError", "No key."], InputError, "No key."),
        (["QC3DError", "No."], QC3DError, "No."),
        (["naming_pair", "What."], WorkerError, "What."),
        (["NoSuchError", "What."], WorkerError, "What."),
        (["MemoryError", ""], WorkerError, "There is not enough memory; use fewer in-betweens"),
    ],
)
def test_errors_of_the_work_keep_their_kind(
    stand_in: Path, temporary: Path, told: list[str], kind: type[QC3DError], said: str
) -> None:
    play(stand_in, MESSAGE_OF_AN_ERROR % told)
    error = failure()
    assert type(error) is kind
    assert str(error).startswith(said)
    assert list(temporary.iterdir()) == []


def test_a_hung_child_is_stopped_after_its_time(stand_in: Path, temporary: Path, tmp_path: Path) -> None:
    own, below = tmp_path / "own", tmp_path / "below"
    play(
        stand_in,
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)",
        "inner = subprocess.Popen(['sleep', '600'])",
        f"open({str(own)!r}, 'w').write(str(os.getpid()))",
        f"open({str(below)!r}, 'w').write(str(inner.pid))",
        "time.sleep(600)",
    )
    assert "was stopped after its time limit of 2 s" in str(failure(Limits(seconds=2.0)))
    wait_until_gone(int(own.read_text()))
    wait_until_gone(int(below.read_text()))
    assert list(temporary.iterdir()) == []


def test_a_child_that_does_nothing_more_is_stopped(
    stand_in: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where a thread got no memory to start with: the others wait for it forever."""
    monkeypatch.setattr(idleness, "LONGEST_IDLE", 3.0)
    monkeypatch.setattr(idleness, "_PAUSE", 1.0)
    play(stand_in, "time.sleep(600)")
    assert "has done nothing for" in str(failure())
    assert list(temporary.iterdir()) == []


def test_a_child_that_is_busy_or_lets_others_work_is_not(
    stand_in: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(idleness, "LONGEST_IDLE", 2.0)
    monkeypatch.setattr(idleness, "_PAUSE", 0.5)
    busy = "import time\nend = time.monotonic() + 5\nwhile time.monotonic() < end: pass"
    play(stand_in, f"subprocess.run([sys.executable, '-c', {busy!r}])", busy, "os._exit(3)")
    assert "exit status 3" in str(failure())


def test_what_a_child_leaves_running_ends_with_it(stand_in: Path, temporary: Path, tmp_path: Path) -> None:
    """It may hold on to the pipe of the messages, which then never ends by itself."""
    below = tmp_path / "below"
    play(
        stand_in,
        "inner = subprocess.Popen(['sleep', '600'])",
        f"open({str(below)!r}, 'w').write(str(inner.pid))",
        "os.kill(os.getpid(), signal.SIGKILL)",
    )
    assert "SIGKILL" in str(failure())
    wait_until_gone(int(below.read_text()))
    assert list(temporary.iterdir()) == []


class TestTheRealChild:
    def test_gives_what_this_process_would(self, temporary: Path) -> None:
        seen: list[Progress] = []
        found = client.run(small_task(), seen.append).bake
        expected = finish(carry_out(small_task())).bake
        assert found is not None
        assert expected is not None
        np.testing.assert_array_equal(found.frames, expected.frames)
        assert found.measures.keys() == expected.measures.keys()
        for name, values in found.measures.items():
            np.testing.assert_array_equal(values, expected.measures[name])
        assert seen
        assert list(temporary.iterdir()) == []

    @pytest.mark.parametrize("megabytes", [1, 4, 16])
    def test_out_of_memory_is_said_with_the_limit(
        self, temporary: Path, megabytes: int, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(Task, "require_memory", lambda *_: None)  # as where the estimate is too low
        with pytest.raises(WorkerError, match=f"not enough memory within its limit of {megabytes} MB; use fewer") as e:
            client.run(small_task("finest"), None, Limits(memory_mb=megabytes))
        assert "raise the limit in the add-on's preferences" in str(e.value)
        assert list(temporary.iterdir()) == []

    def test_too_large_a_task_is_refused_before_it_starts(
        self, temporary: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(child.subprocess, "Popen", None)
        with pytest.raises(InputError, match=r"The bake of 58 vertices needs about \d+ MB .* limit is 20 MB"):
            client.run(small_task(), None, Limits(memory_mb=20))
        assert list(temporary.iterdir()) == []

    def test_killed_from_outside(self, temporary: Path) -> None:
        worker = Worker(small_task("finest"))
        pid = worker._process.pid
        while worker.progress is None:
            assert worker.poll() is None
            time.sleep(0.01)
        os.kill(pid, signal.SIGKILL)
        worker._process.wait()
        with pytest.raises(WorkerError, match="SIGKILL"):
            worker.poll()
        worker.close()
        assert not is_alive(pid)
        assert list(temporary.iterdir()) == []

    def test_closed_at_once(self, temporary: Path) -> None:
        worker = Worker(small_task())
        worker.close()
        worker.close()
        assert not is_alive(worker._process.pid)
        assert list(temporary.iterdir()) == []

    @pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
    def test_nothing_outlives_the_process_that_waits(self, temporary: Path, repository: Path, ending: int) -> None:
        program = (
            "import signal\n"
            "from tests.worker.test_client import small_task\n"
            "from qc3d_addon.worker.client import Worker\n"
            # A job in the background starts with Ctrl-C ignored.
            "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
            "worker = Worker(small_task('finest'))\n"
            "while worker.progress is None: worker.poll()\n"
            "print(worker._process.pid, flush=True)\n"
            "worker._process.wait()\n"
        )
        environment = {**os.environ, "TMPDIR": str(temporary)}
        with subprocess.Popen(
            [sys.executable, "-c", program],
            cwd=repository,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as waiting:
            assert waiting.stdout is not None
            child = int(waiting.stdout.readline())
            assert is_alive(child)
            waiting.send_signal(ending)
        wait_until_gone(child)
        assert list(temporary.iterdir()) == []


def test_no_room_for_the_task(monkeypatch: pytest.MonkeyPatch, temporary: Path) -> None:
    def no_room(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(exchange, "write_task", no_room)
    said = str(failure())
    assert f"temporary files in {temporary}: No space left on device; make room on that disk" in said
    assert list(temporary.iterdir()) == []


def test_no_folder_for_temporary_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    said = str(failure())
    assert f"temporary files in {tmp_path / 'none'}: No such file or directory; make that folder first" in said


def test_no_interpreter(monkeypatch: pytest.MonkeyPatch, temporary: Path) -> None:
    monkeypatch.setattr(child, "interpreter", lambda: None)
    assert "No Python interpreter was found" in str(failure())
    assert list(temporary.iterdir()) == []


def test_an_interrupt_while_it_starts(monkeypatch: pytest.MonkeyPatch, temporary: Path) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(exchange, "write_task", interrupted)
    with pytest.raises(KeyboardInterrupt):
        client.run(small_task())
    assert list(temporary.iterdir()) == []
