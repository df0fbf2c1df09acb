# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d batch --dask``: on a real cluster of several processes, one of which is killed on the way."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time as clock
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import distributed
import psutil
import pytest

from qc3d_addon.cli import main

JOBS = """
[defaults]
frames = 1

[[job]]
file = "bar.blend"
object = "Bar"
all-keys = true
output = "out/bar.blend"

[[job.then]]
command = "export"
object = "Bar"
output = "out/bar.glb"
"""
PAIR = """
[[job]]
command = "interpolate"
file = "bar.npz"
from = "straight"
to = "bent"
frames = 1
seed = {number}
output = "out/{number}.npz"
"""
# A job in the background starts with Ctrl-C ignored.
INTERRUPTIBLE = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from qc3d_addon.start import main
sys.exit(main())
"""
T = TypeVar("T")


class Watch:
    """Sees each file that takes one of the places."""

    def __init__(self, folder: Path) -> None:
        self.seen: dict[str, set[tuple[int, int]]] = {}
        self._folder = folder
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._look)

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ends.set()
        self._thread.join()

    def _look(self) -> None:
        while not self._ends.wait(0.005):
            for path in self._folder.glob("[!.]*.*"):
                found = path.stat()
                self.seen.setdefault(path.name, set()).add((found.st_ino, found.st_mtime_ns))


def is_of_job(process: psutil.Process) -> bool:
    with suppress(psutil.Error):  # it has just ended
        return "batch-job" in process.cmdline()
    return False


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kills a process as Linux and macOS do")
def test_a_worker_is_killed_and_nothing_is_lost_or_done_twice(
    bar_file: Path,
    bar_scene: Path,
    repository: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = bar_file.parent
    (folder / "bar.blend").write_bytes(bar_scene.read_bytes())
    path = folder / "jobs.toml"
    path.write_text(JOBS + "".join(PAIR.format(number=number) for number in range(3)))
    monkeypatch.setenv("PYTHONPATH", str(repository))  # the workers are processes of their own
    (folder / "out").mkdir()
    status: list[int] = []
    with (
        distributed.LocalCluster(
            n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=str(folder)
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
        Watch(folder / "out") as watch,
    ):
        workers = [psutil.Process(number) for number in client.run(os.getpid).values()]
        arguments = ["batch", str(path), "--dask", cluster.scheduler_address]
        batch = threading.Thread(target=lambda: status.append(main.main(arguments)))
        batch.start()
        # The first worker with a job on its way, after another one has written a result.
        found: dict[psutil.Process, list[psutil.Process]] = {}
        while not found:
            assert batch.is_alive()
            clock.sleep(0.01)
            if any((folder / "out").glob("*.npz")):
                jobs_of = {worker: [child for child in worker.children() if is_of_job(child)] for worker in workers}
                found = {worker: children for worker, children in jobs_of.items() if children}
        struck, children = next(iter(found.items()))
        struck_job = json.loads((Path(children[0].cmdline()[-1]) / "order.json").read_text())["job"]["name"]
        struck.send_signal(signal.SIGKILL)
        psutil.wait_procs(children)  # they end with it
        batch.join()
    assert status == [0]
    report = json.loads((folder / "jobs.batch" / "report.json").read_text())
    assert report["done"] == len(report["jobs"]) == 5
    assert {one["name"]: len(watch.seen[Path(one["name"]).name]) for one in report["jobs"]} == {
        one["name"]: 1 for one in report["jobs"]
    }
    assert struck_job in {one["name"] for one in report["jobs"]}
    assert "5 jobs in " in capsys.readouterr().out
    # All is done, as another run finds without a cluster.
    assert main.main(["batch", str(path)]) == 0
    assert "5 resumed" in capsys.readouterr().out


def jobs_file(folder: Path, repository: Path, monkeypatch: pytest.MonkeyPatch, count: int) -> Path:
    """So many jobs, for processes that find this package."""
    monkeypatch.setenv("PYTHONPATH", str(repository))
    (folder / "out").mkdir()
    path = folder / "jobs.toml"
    path.write_text("".join(PAIR.format(number=number) for number in range(count)))
    return path


def wait_for(condition: Callable[[], T], alive: Callable[[], bool]) -> T:
    """Wait until a condition gives something true, and return it."""
    while not (found := condition()):
        assert alive()
        clock.sleep(0.01)
    return found


def jobs_below(*processes: psutil.Process) -> list[psutil.Process]:
    """The jobs that these processes have started."""
    found: list[psutil.Process] = []
    for process in processes:
        with suppress(psutil.Error):
            found += [child for child in process.children(recursive=True) if is_of_job(child)]
    return found


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kills a process as Linux and macOS do")
def test_the_scheduler_is_lost_on_the_way(
    bar_file: Path, repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = bar_file.parent
    path = jobs_file(folder, repository, monkeypatch, 4)
    told = folder / "scheduler.json"
    quiet = ["--no-dashboard", "--scheduler-file", str(told)]
    parts = [("scheduler", ["--port", "0"]), ("worker", ["--no-nanny", "--nthreads", "1", "--death-timeout", "60"])]
    running: list[psutil.Popen] = []
    status: list[int] = []
    try:
        for part, more in parts:
            command = [sys.executable, "-m", f"distributed.cli.dask_{part}", *quiet, *more]
            running.append(psutil.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
            wait_for(told.exists, lambda: running[-1].poll() is None)
        scheduler, worker = running
        address = json.loads(told.read_text())["address"]
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(1)
        batch = threading.Thread(target=lambda: status.append(main.main(["batch", str(path), "--dask", address])))
        batch.start()
        out = folder / "out"
        wait_for(lambda: any(out.glob("[!.]*.npz")) and jobs_below(worker), batch.is_alive)
        scheduler.send_signal(signal.SIGKILL)
        batch.join()
        # Either the job on its way was given up, or it has been done; the worker is not waited for.
        psutil.wait_procs(jobs_below(worker))
    finally:
        for process in running:
            with suppress(psutil.Error):
                process.kill()
    psutil.wait_procs(running)
    assert status == [3]
    report = json.loads((folder / "jobs.batch" / "report.json").read_text())
    assert report["done"] >= 1
    lost = [one["error"]["message"] for one in report["jobs"] if one["ended"] == "failed"]
    assert len(lost) == report["failed"] == 4 - report["done"] > 0
    assert all("The cluster lost the job: " in message and "run the batch again." in message for message in lost)
    capsys.readouterr()
    assert main.main(["batch", str(path), "--processes", "2"]) == 0
    done = {one["ended"] for one in json.loads((folder / "jobs.batch" / "report.json").read_text())["jobs"]}
    assert done <= {"done", "resumed"}
    assert sorted(path.name for path in out.iterdir()) == [f"{number}.npz" for number in range(4)]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal as Linux and macOS do")
def test_ctrl_c_ends_the_jobs_on_a_cluster(
    bar_file: Path, repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = bar_file.parent
    path = jobs_file(folder, repository, monkeypatch, 5)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=str(folder)
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        workers = [psutil.Process(number) for number in client.run(os.getpid).values()]
        command = [sys.executable, "-c", INTERRUPTIBLE, "batch", str(path), "--dask", cluster.scheduler_address]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as batch:
            out = folder / "out"
            wait_for(lambda: any(out.glob("[!.]*.npz")) and jobs_below(*workers), lambda: batch.poll() is None)
            batch.send_signal(signal.SIGINT)
            said = batch.communicate()
        assert batch.returncode == 130, said
        assert "Interrupted; what is done stays" in said[1]
        assert "Traceback" not in said[1]
        psutil.wait_procs(jobs_below(*workers))  # those that were told to end
        before = sorted(out.iterdir())
        assert not jobs_below(*workers)
        assert sorted(out.iterdir()) == before
    report = json.loads((folder / "jobs.batch" / "report.json").read_text())
    assert report["stopped"] > 0
    assert report["done"] + report["stopped"] == 5
    done = {Path(one["name"]).name for one in report["jobs"] if one["ended"] == "done"}
    assert done == {path.name for path in before}
    assert main.main(["batch", str(path), "--processes", "2"]) == 0
    if done:
        assert f"{report['done']} resumed" in capsys.readouterr().out
    assert sorted(path.name for path in out.iterdir()) == [f"{number}.npz" for number in range(5)]


def test_nobody_answers(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "jobs.toml").write_text(PAIR.format(number=1))
    monkeypatch.setattr("qc3d_addon.cli.batch.pools._SECONDS_TO_CONNECT", 0.1)
    assert main.main(["batch", str(tmp_path / "jobs.toml"), "--dask", "tcp://127.0.0.1:9"]) == 2
    assert "No Dask scheduler answers at tcp://127.0.0.1:9: " in capsys.readouterr().err


def test_it_says_how_to_install_dask(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "jobs.toml").write_text(PAIR.format(number=1))
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main.main(["batch", str(tmp_path / "jobs.toml"), "--dask", "tcp://127.0.0.1:9"]) == 2
    assert 'install it by pip install "qc3d[dask]".' in capsys.readouterr().err


def test_dask_is_loaded_only_when_it_is_asked_for(repository: Path) -> None:
    code = "import sys; import qc3d_addon.cli.main; print([n for n in ('dask', 'distributed') if n in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], cwd=repository, capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"
