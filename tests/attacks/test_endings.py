# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""However a command ends, it leaves no process and no temporary file behind."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.frames.task import Task
from qc3d_addon.solver.meshing.tetwild_loading import unavailable_reason
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.worker.client import Worker

from ..command_lines import with_others
from ..worker.test_client import small_task
from .commands import KEYS, is_alive, listing

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")
needs_tetwild = pytest.mark.skipif(unavailable_reason() is not None, reason=f"tetwild: {unavailable_reason()}")

PATIENCE = 60.0
PROGRAM = """
import os, signal, sys
from pathlib import Path
signal.signal(signal.SIGINT, signal.default_int_handler)
for number in (signal.SIGHUP, signal.SIGQUIT):
    signal.signal(number, signal.SIG_DFL)  # a job in the background starts with some of them ignored
from qc3d_addon.solver.meshing import tetwild, tetwild_loading
{lines}
from qc3d_addon.start import main
sys.exit(main())
"""
STAND_IN = """
tetwild_loading.CHILD, tetwild_loading._wrapper = Path({script!r}), lambda: Path("wrapper")
"""
INTERPOLATE = ["interpolate", "bar.npz", *KEYS, "--frames", "0", "--output", "new.npz", "--report", "new.json"]


def wait_for(condition: Callable[[], object], what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.02)


def numbers_of(text: str) -> list[int]:
    """Processes with a text in their command line."""
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if text.encode() in file.read_bytes() and is_alive(int(file.parent.name)):
                found.append(int(file.parent.name))
        except OSError:
            continue
    return found


@pytest.fixture
def begun(here: Path, tmp_path: Path, killed: list[int]) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts the command, with a program that sleeps in the place of fTetWild, and waits until that sleeps."""
    running: list[subprocess.Popen[str]] = []

    def begin(lines: str = "", waits: bool = True) -> subprocess.Popen[str]:
        script, own = tmp_path / "child.py", tmp_path / "own"
        script.write_text(f"import os, time\nopen({str(own)!r}, 'w').write(f'{{os.getpid()}}.')\ntime.sleep(600)\n")
        program = PROGRAM.format(lines=STAND_IN.format(script=str(script)) + lines)
        process = subprocess.Popen(
            [sys.executable, "-c", program, *INTERPOLATE, "--engine", "tetwild"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        running.append(process)
        if waits:
            wait_for(lambda: own.exists() and own.read_text().endswith("."), "the program was not started")
            killed.append(int(own.read_text()[:-1]))
        return process

    yield begin
    for process in running:
        process.kill()
        process.communicate()


ENDINGS = [signal.SIGKILL, signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM, signal.SIGINT]


@pytest.mark.parametrize("with_group", [False, True], ids=["alone", "with its group"])
@pytest.mark.parametrize("number", ENDINGS)
def test_nothing_of_a_command_goes_on(
    begun: Callable[..., subprocess.Popen[str]],
    here: Path,
    temporary: Path,
    killed: list[int],
    number: signal.Signals,
    with_group: bool,
) -> None:
    before = listing(here)
    process = begun()
    assert len(list(temporary.iterdir())) == 1
    (os.killpg if with_group else os.kill)(process.pid, number)
    _, said = process.communicate(timeout=PATIENCE)
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == 130
        assert said == "qc3d: Interrupted; nothing was written.\n"
    wait_for(lambda: not is_alive(killed[0]), "the program goes on")
    wait_for(lambda: not list(temporary.iterdir()), "the folder is there")
    wait_for(lambda: not numbers_of(str(temporary)), "a process of ours goes on")
    assert listing(here) == before


@pytest.mark.parametrize(
    "lines",
    [
        "tetwild.np.save = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)",
        "tetwild.load_command = lambda: os.kill(os.getpid(), signal.SIGKILL)",
        "tetwild.Guardian.run = lambda *_: os.kill(os.getpid(), signal.SIGKILL)",
        "tetwild._require_success = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
        "Path(tetwild_loading.CHILD).write_text('')",
    ],
)
def test_no_folder_stays_whenever_it_is_killed(
    begun: Callable[..., subprocess.Popen[str]], temporary: Path, lines: str
) -> None:
    process = begun(f"\n{lines}\n", waits=False)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == -signal.SIGKILL
    wait_for(lambda: not list(temporary.iterdir()), "the folder is there")


@pytest.mark.parametrize("seed", range(6))
def test_killed_at_any_moment(
    begun: Callable[..., subprocess.Popen[str]], here: Path, temporary: Path, seed: int
) -> None:
    before = listing(here)
    process = begun(waits=False)
    time.sleep(random.Random(seed).uniform(0.0, 2.0))
    process.kill()
    process.communicate(timeout=PATIENCE)
    wait_for(lambda: not numbers_of(str(temporary)), "a process of ours goes on")
    wait_for(lambda: not list(temporary.iterdir()), "the folder is there")
    assert listing(here) == before


def test_where_hang_ups_are_ignored_it_works_on(here: Path, temporary: Path) -> None:
    """As with nohup."""
    program = PROGRAM.format(lines="signal.signal(signal.SIGHUP, signal.SIG_IGN)").replace(
        "from qc3d_addon.start", "os.kill(os.getpid(), signal.SIGHUP)\nfrom qc3d_addon.start"
    )
    strike = "\nfrom qc3d_addon.cli import interpolate as command\nread = command.read_pairs\n"
    strike += "def hung_up(*all, **named):\n    os.kill(os.getpid(), signal.SIGHUP)\n    return read(*all, **named)\n"
    strike += "command.read_pairs = hung_up\n"
    program = program.replace("from qc3d_addon.start", f"{strike}from qc3d_addon.start")
    arguments = [*INTERPOLATE, "--mode", "straight"]
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, done.stderr) == (0, "")


def test_where_the_guardian_is_killed_the_program_ends_too(
    begun: Callable[..., subprocess.Popen[str]], temporary: Path, killed: list[int]
) -> None:
    process = begun()
    (guardian,) = numbers_of("guardian.py")
    os.kill(guardian, signal.SIGKILL)
    said = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 2
    assert "qc3d: The meshing engine tetwild cannot work with temporary files in" in said
    assert "the process that watched it was killed" in said
    assert not is_alive(killed[0])
    assert not list(temporary.iterdir())


@needs_tetwild
class TestTheRealEngine:
    def test_ends_with_a_command_that_is_killed(self, here: Path, temporary: Path) -> None:
        program = PROGRAM.format(lines="")
        command = [sys.executable, "-c", program, *INTERPOLATE, "--engine", "tetwild", "--quality", "finest"]
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
            wait_for(lambda: numbers_of("tetwild_child.py"), "fTetWild was not started")
            process.kill()
        wait_for(lambda: not numbers_of(str(temporary)), "fTetWild goes on")
        wait_for(lambda: not list(temporary.iterdir()), "the folder is there")

    def test_ends_with_a_bake_that_is_cancelled(self, temporary: Path) -> None:
        worker = Worker(_with_tetwild())
        try:
            wait_for(lambda: numbers_of("tetwild_child.py"), "fTetWild was not started")
        finally:
            worker.close()
        wait_for(lambda: not numbers_of(str(temporary)), "fTetWild goes on")
        assert not list(temporary.iterdir())

    def test_ends_with_a_bake_whose_process_is_killed(self, temporary: Path) -> None:
        """By the system, where memory runs out."""
        worker = Worker(_with_tetwild())
        try:
            wait_for(lambda: numbers_of("tetwild_child.py"), "fTetWild was not started")
            worker._process.kill()
            wait_for(lambda: not numbers_of("tetwild_child.py"), "fTetWild goes on")
        finally:
            worker.close()
        assert not list(temporary.iterdir())

    def test_ends_with_blender(self, temporary: Path, repository: Path) -> None:
        program = (
            "from tests.attacks.test_endings import _with_tetwild\n"
            "from qc3d_addon.worker.client import Worker\n"
            "worker = Worker(_with_tetwild())\nworker._process.wait()\n"
        )
        with subprocess.Popen([sys.executable, "-c", program], cwd=repository, stderr=subprocess.DEVNULL) as blender:
            wait_for(lambda: numbers_of("tetwild_child.py"), "fTetWild was not started")
            blender.kill()
        wait_for(lambda: not numbers_of(str(temporary)), "fTetWild goes on")
        wait_for(lambda: not list(temporary.iterdir()), "the folder is there")


def _with_tetwild() -> Task:
    return replace(small_task("finest"), fit_options=FitOptions(engine="tetwild", quality="finest"))


class TestSeveralAtOnce:
    WRITER = (
        "import random, sys, time\nfrom pathlib import Path\n"
        "from qc3d_addon.solver.files.atomic import replacing_all\n"
        "choose, folder, rounds = random.Random(int(sys.argv[1])), Path(sys.argv[2]), int(sys.argv[3])\n"
        "print('ready', flush=True)\n"
        "for number in range(rounds):\n"
        "    text = f'{sys.argv[1]} {number} ' * 20_000\n"
        "    with replacing_all(folder / 'new.npz', folder / 'new.json') as new:\n"
        "        for path in new:\n"
        "            path.write_text(text)\n"
    )

    def start(self, seed: int, folder: Path, rounds: int) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", self.WRITER, str(seed), str(folder), str(rounds)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    def test_the_last_one_has_both_its_files_there(self, tmp_path: Path) -> None:
        writers = [self.start(seed, tmp_path, 40) for seed in range(4)]
        for writer in writers:
            writer.communicate(timeout=300)
            assert writer.returncode == 0
        output, report = (tmp_path / "new.npz").read_text(), (tmp_path / "new.json").read_text()
        assert output == report
        assert sorted(os.listdir(tmp_path)) == ["new.json", "new.npz"]

    @pytest.mark.parametrize("seed", range(5))
    def test_killed_at_any_moment_they_leave_whole_files(self, tmp_path: Path, seed: int) -> None:
        choose = random.Random(seed)
        writers = [self.start(number, tmp_path, 10**6) for number in range(3)]
        for writer in writers:
            assert writer.stdout is not None
            assert writer.stdout.readline() == "ready\n"
        for writer in writers:
            time.sleep(choose.uniform(0.0, 0.3))
            writer.kill()
            writer.communicate()
        for name in ("new.npz", "new.json"):
            if (tmp_path / name).exists():
                text = (tmp_path / name).read_text()
                assert text == " ".join(text.split()[:2]).join(["", " "]) * 20_000
        for left in tmp_path.glob(".qc3d-*"):
            os.utime(left, (0.0, 0.0))  # one that was killed as it made a folder leaves it for a minute
        last = self.start(9, tmp_path, 1)
        last.communicate(timeout=60)
        assert sorted(os.listdir(tmp_path)) == ["new.json", "new.npz"]

    def test_two_bakes_onto_one_file(self, here: Path) -> None:
        """Whole .blend files both times, whichever ends last, and the same frames as alone."""
        keys = ["--object", "Bar", "--from", "Basis", "--to", "Bent", "--mode", "straight"]
        command = [sys.executable, "-m", "qc3d_addon", "bake", "bar.blend", *keys, "--output", "bar.blend"]
        bakes = [
            subprocess.Popen([*command, "--frames", str(count), "--report", f"{count}.json"], stderr=subprocess.PIPE)
            for count in (1, 2)
        ]
        for bake in bakes:
            assert bake.communicate(timeout=300)[1] == b""
            assert bake.returncode == 0
        import bpy

        bpy.ops.wm.open_mainfile(filepath=str(here / "bar.blend"))
        names = [key.name for key in bpy.data.objects["Bar"].data.shape_keys.key_blocks]
        assert len(names) in (3, 4, 5)
        assert not [name for name in os.listdir() if name.startswith(".")]


class TestFullTemporaryDisks:
    """Said as such; a lower quality would not help."""

    @pytest.fixture
    def full(self, small_disk: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        monkeypatch.setattr(tempfile, "tempdir", str(small_disk))
        (small_disk / "ballast").write_bytes(bytes(os.statvfs(small_disk).f_bavail * 4096 - 8192))
        return small_disk

    @needs_tetwild
    def test_with_the_engine_that_needs_one(self, full: Path, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
        from qc3d_addon.cli import main

        assert main.main(with_others(INTERPOLATE, ["--engine", "tetwild"])) == 2
        said = capsys.readouterr().err
        assert "qc3d: The meshing engine tetwild cannot work with temporary files in " in said
        assert "No space left on device; make room on that disk" in said
        assert "lower quality" not in said
        assert len(said.splitlines()) == 1
        assert os.listdir(full) == ["ballast"]
        assert main.main(with_others(INTERPOLATE, ["--engine", "auto"])) == 0
        assert "No space left on device" in capsys.readouterr().err

    @needs_tetwild
    def test_where_there_is_no_folder_at_all(
        self, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from qc3d_addon.cli import main

        def none() -> str:
            raise FileNotFoundError(2, "No usable temporary directory found")

        monkeypatch.setattr(tempfile, "gettempdir", none)
        assert main.main(with_others(INTERPOLATE, ["--engine", "tetwild"])) == 2
        assert "in any of the places for them: No usable temporary directory found; make" in capsys.readouterr().err
        assert main.main(with_others(INTERPOLATE, ["--engine", "auto"])) == 0

    def test_where_blender_starts_a_bake(self, full: Path) -> None:
        from qc3d_addon.solver.errors import WorkerError

        with pytest.raises(WorkerError, match=r"temporary files in .*: No space left on device; make room") as caught:
            Worker(small_task())
        assert "lower quality" not in str(caught.value)
        assert os.listdir(full) == ["ballast"]

    def test_where_the_result_of_a_bake_has_no_room(self, temporary: Path) -> None:
        """A limit on the size of files stands for a disk: the task is below it, and its result above."""
        import resource

        from qc3d_addon.solver.errors import WorkerError
        from qc3d_addon.worker import client

        task = small_task()
        task = replace(task, times=np.linspace(0.0, 1.0, 402))
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
        try:
            with pytest.raises(WorkerError, match="cannot go on: File too large; raise the limit") as caught:
                client.run(task)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert "lower quality" not in str(caught.value)
        assert not list(temporary.iterdir())
