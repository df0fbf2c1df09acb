# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d batch``: results are whole, made once, and made again when what they are made from has changed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time as clock
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from qc3d_addon.cli import main
from qc3d_addon.cli.batch.children import Budget
from qc3d_addon.solver.files import atomic

REPOSITORY = Path(__file__).parents[2]

JOB = """
[[job]]
command = "interpolate"
file = "{file}"
from = "straight"
to = "bent"
frames = 2
mode = "{mode}"
output = "out/{output}"
"""


def job(output: str, mode: str = "straight", file: str = "bar.npz", more: str = "") -> str:
    return JOB.format(file=file, mode=mode, output=output) + more


def write_jobs(folder: Path, *jobs: str) -> Path:
    path = folder / "jobs.toml"
    path.write_text("".join(jobs), encoding="utf-8")
    return path


def run(path: Path, *more: str) -> tuple[int, dict[str, Any], dict[str, str]]:
    """The exit status, the report, and how each job ended."""
    status = main.main(["batch", str(path), *more])
    report = json.loads((path.parent / "jobs.batch" / "report.json").read_text())
    return status, report, {one["name"]: one["ended"] for one in report["jobs"]}


def identity(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_ino, found.st_mtime_ns


def left_over(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.name.startswith(".qc3d-")]


@pytest.fixture
def hidden_temporary(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for temporary files, which is empty again at the end."""
    folder = tmp_path_factory.mktemp("temporary")
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    yield folder
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_what_is_done_and_unchanged_is_not_done_again(
    bar_file: Path, bar: dict[str, np.ndarray], hidden_temporary: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = bar_file.parent
    other = folder / "other.npz"
    np.savez(other, **bar)
    report = 'report = "out/c.json"\n'
    jobs = [job("a.npz"), job("b.npz", file="other.npz"), job("c.npz", more=report), job("d.npz", file="none.npz")]
    path = write_jobs(folder, *jobs)
    status, told, ended = run(path)
    said = capsys.readouterr()
    assert status == 3
    assert ended == {"out/a.npz": "done", "out/b.npz": "done", "out/c.npz": "done", "out/d.npz": "failed"}
    assert (told["done"], told["resumed"], told["failed"], told["stopped"]) == (3, 0, 1, 0)
    assert told["jobs"][3]["error"]["type"] == "InputError"
    assert "none.npz cannot be read: No such file" in told["jobs"][3]["error"]["message"]
    assert "qc3d: out/d.npz: InputError: " in said.err
    assert "4 jobs in " in said.out
    assert all(one["seconds"] > 0.0 and one["peak_memory_mb"] > 10.0 for one in told["jobs"][:3])
    assert len(np.load(folder / "out" / "a.npz")["frames"]) == 4
    assert json.loads((folder / "out" / "c.json").read_text())["mode"] == "straight"
    before = {name: identity(folder / "out" / f"{name}.npz") for name in "abc"}

    def again() -> str:
        """Which results an unchanged run writes again."""
        nonlocal before
        run(path)
        now = {name: identity(folder / "out" / f"{name}.npz") for name in "abc"}
        made, before = "".join(name for name in "abc" if now[name] != before[name]), now
        return made

    jobs.pop()
    write_jobs(folder, *jobs)
    assert again() == ""
    other.touch()
    assert again() == ""  # the same content at another time
    np.savez(other, **{**bar, "V1": bar["V1"] + 0.5})
    assert again() == "b"
    jobs[0] = jobs[0].replace("frames = 2", "frames = 3")
    write_jobs(folder, *reversed(jobs))
    assert again() == "a"
    (folder / "out" / "a.npz").write_bytes(b"half")
    (folder / "out" / "c.json").unlink()
    before["a"] = identity(folder / "out" / "a.npz")
    assert again() == "ac"
    records = folder / "jobs.batch"
    for record in [*records.glob("b-*.json"), *records.glob("c-*.json")]:
        values = json.loads(record.read_text())
        record.write_text(json.dumps({**values, "version": "0"}) if record.name.startswith("b") else "{")
    assert again() == "bc"
    jobs[0] += 'easing = "linear"\nseed = 0\n'  # the defaults
    write_jobs(folder, *jobs)
    assert again() == ""
    assert left_over(folder) == []


@pytest.mark.slow
def test_blender_files_and_what_follows_them(
    bar_scene: Path, tmp_path: Path, hidden_temporary: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(bar_scene))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"), copy=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (source, target):
        target.meshes = source.meshes[1:]
    bpy.context.collection.objects.link(bpy.data.objects.new("Linked", target.meshes[0]))
    (tmp_path / "in").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in" / "bar.blend"), relative_remap=True)
    path = write_jobs(
        tmp_path,
        '[[job]]\nfile = "in/*.blend"\nobject = "Bar"\nall-keys = true\nframes = 1\noutput = "out/{name}.blend"\n',
        '[[job.then]]\ncommand = "export"\nobject = "Bar"\noutput = "out/{name}.glb"\n',
        '[[job.then]]\ncommand = "export"\nobject = "Nobody"\noutput = "out/no.glb"\n',
        '[[job.then.then]]\ncommand = "export"\nobject = "Bar"\noutput = "out/never.glb"\n',
    )
    status, told, ended = run(path)
    assert status == 3
    assert ended == {
        "out/bar.blend": "done",
        "out/bar.glb": "done",
        "out/no.glb": "failed",
        "out/never.glb": "failed",
    }
    assert "has no object 'Nobody'" in told["jobs"][2]["error"]["message"]
    assert "'out/no.glb', which failed" in told["jobs"][3]["error"]["message"]
    assert told["jobs"][0]["notes"]
    assert (tmp_path / "out" / "bar.glb").read_bytes()[:4] == b"glTF"
    assert left_over(tmp_path) == []
    assert run(path)[2]["out/bar.blend"] == "resumed"
    with (tmp_path / "library.blend").open("ab") as file:
        file.write(b"changed")
    assert main.main(["batch", str(path), "--dry-run", "--only", "out/bar.glb"]) == 0
    assert "2 jobs, 2 to do." in capsys.readouterr().out


@pytest.mark.slow
def test_in_place_the_file_is_its_own_result(bar_scene: Path, tmp_path: Path, hidden_temporary: Path) -> None:
    file = tmp_path / "bar.blend"
    file.write_bytes(bar_scene.read_bytes())
    path = write_jobs(
        tmp_path, '[[job]]\nfile = "bar.blend"\nobject = "Bar"\nall-keys = true\nframes = 1\nin-place = true\n'
    )
    assert run(path)[2] == {"bar.blend": "done"}
    made = file.read_bytes()
    assert made != bar_scene.read_bytes()
    assert run(path)[2] == {"bar.blend": "resumed"}
    assert file.read_bytes() == made


def started(path: Path, *more: str) -> subprocess.Popen[str]:
    """The command in a process of its own, of a group of its own."""
    command = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    command += "from qc3d_addon.start import main; sys.exit(main())"
    return subprocess.Popen(
        [sys.executable, "-c", command, "batch", str(path), *more],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def processes_with(word: str) -> list[int]:
    """Processes whose command line has a word."""
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = file.read_bytes().split(b"\0")
        except OSError:
            continue
        if any(word.encode() in one for one in words):
            found.append(int(file.parent.name))
    return found


def wait_for(found: Any, process: subprocess.Popen[str] | None = None) -> None:  # noqa: ANN401 - a function
    while not found():
        assert process is None or process.poll() is None, process.communicate()
        clock.sleep(0.02)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks at processes as Linux tells them")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_stopped_it_leaves_what_is_done_and_goes_on(
    bar_file: Path, hidden_temporary: Path, number: signal.Signals
) -> None:
    folder = bar_file.parent
    modes = ["straight", "natural", "linear"]
    path = write_jobs(folder, *(job(f"{mode}.npz", mode) for mode in modes))
    process = started(path, "--processes", "1")
    wait_for((folder / "out" / "straight.npz").exists, process)
    # The second job is on its way.
    wait_for(lambda: len(list((folder / "jobs.batch").glob("*.lock"))) == 2, process)
    assert processes_with(str(hidden_temporary)) != []
    process.send_signal(number)
    said, errors = process.communicate()
    wait_for(lambda: processes_with(str(hidden_temporary)) == [])
    first = identity(folder / "out" / "straight.npz")
    assert {path.suffix for path in (folder / "out").iterdir() if path.is_file()} == {".npz"}
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == 130
        assert "qc3d: Interrupted; what is done stays, and the same command goes on from here." in errors
        assert "stopped" in said
        assert left_over(folder) == []
        assert json.loads((folder / "jobs.batch" / "report.json").read_text())["stopped"] >= 1
    status, _, ended = run(path)
    assert status == 0
    assert ended["out/straight.npz"] == "resumed"
    assert "done" in ended.values()
    assert identity(folder / "out" / "straight.npz") == first
    assert left_over(folder) == []


@pytest.mark.slow
def test_two_batches_at_once_share_the_work(bar_file: Path, hidden_temporary: Path) -> None:
    path = write_jobs(bar_file.parent, *(job(f"{name}.npz", "natural") for name in "ab"))
    both = [started(path, "--report", str(bar_file.parent / f"{number}.json")) for number in (1, 2)]
    for process in both:
        assert process.communicate()[1] == ""
        assert process.returncode == 0
    reports = [json.loads((bar_file.parent / f"{number}.json").read_text())["jobs"] for number in (1, 2)]
    for jobs in zip(*reports, strict=True):
        assert sorted(one["ended"] for one in jobs) == ["done", "resumed"]


@pytest.mark.slow
def test_memory_is_asked_for_before_the_work(bar_file: Path, hidden_temporary: Path) -> None:
    path = write_jobs(bar_file.parent, job("a.npz", "natural"))
    status, told, _ = run(path, "--memory", "50")
    assert status == 3
    assert "MB of memory, and its limit is 50 MB" in told["jobs"][0]["error"]["message"]
    assert run(path, "--memory", "200")[0] == 0


def test_memory_is_shared() -> None:
    budget = Budget(1000)
    assert budget.takes("a", 300.0)
    assert budget.takes("b", 300.0)
    assert budget.takes("a", 600.0)
    assert not budget.takes("b", 500.0)
    assert not budget.takes("c", 200.0)
    budget.give_back("a")
    assert budget.takes("b", 500.0)
    assert budget.takes("c", 200.0)
    assert not budget.takes("c", 2000.0)
    assert budget.takes("b", 2000.0)  # all others wait for it
    budget.give_back("b")
    assert budget.takes("c", 2000.0)
    assert Budget(0).takes("a", 1e9)


def test_files_are_told_before_they_take_their_places(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    first.write_text("old")
    seen: list[dict[Path, Path]] = []

    def see(files: dict[Path, Path]) -> None:
        assert first.read_text() == "old"
        assert not second.exists()
        assert [file.read_text() for file in files.values()] == ["new", "other"]
        seen.append(files)

    def refuse(files: dict[Path, Path]) -> None:
        raise ValueError

    for call in (see, refuse):
        first.write_text("old")
        second.unlink(missing_ok=True)
        try:
            with atomic.before_replacing(call), atomic.replacing_all(first, second) as (new, other):
                new.write_text("new")
                other.write_text("other")
        except ValueError:
            assert call is refuse
            assert first.read_text() == "old"
            assert not second.exists()
    assert [list(files) for files in seen] == [[first, second]]
    with atomic.replacing(first) as new:
        new.write_text("later")
    assert len(seen) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["first"]
