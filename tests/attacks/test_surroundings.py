# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile surroundings: closed or broken streams, system limits, and files named like libraries."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.meshing.tetwild_loading import unavailable_reason

from .commands import COMMANDS, KEYS, QUICK, command, is_sentence

pytestmark = pytest.mark.skipif(os.name == "nt", reason="closes streams and sets limits as Linux and macOS do")

PROGRAM = [sys.executable, "-m", "qc3d_addon"]
INTERPOLATE = ["interpolate", "bar.npz", *KEYS, "--frames", "0", *QUICK, "--output", "new.npz"]
NATURAL = ["interpolate", "bar.npz", *KEYS, "--output", "new.npz"]
COMPRESS = ["compress", "map.npz", "--modes", "3", "--scheme", "published", "--output", "new.qc3d"]


def run(arguments: list[str], **options: object) -> subprocess.CompletedProcess[bytes]:
    found: subprocess.CompletedProcess[bytes] = subprocess.run(
        [*PROGRAM, *arguments],
        timeout=300,
        **options,  # type: ignore[call-overload]
    )
    return found


class TestStreams:
    @pytest.mark.parametrize("closed", ["2>&-", ">&-", "<&-", ">&- 2>&-", "<&- >&- 2>&-"])
    @pytest.mark.parametrize("name", ["interpolate", "bake", "compress"])
    def test_that_are_closed(self, name: str, closed: str, here: Path) -> None:
        """The first files that are opened would get their numbers, and with them what native code has to say."""
        output = here / f"new{COMMANDS[name][1]}"
        quoted = " ".join(f"'{part}'" for part in [*PROGRAM, *command(name, output)])
        done = subprocess.run(["sh", "-c", f"{quoted} {closed}"], capture_output=True, timeout=300)
        assert done.returncode == 0
        assert done.stderr == b""
        if name == "interpolate":
            with np.load(output) as stored:
                assert all(np.isfinite(stored[key]).all() for key in stored.files if stored[key].dtype.kind == "f")
        elif name == "bake":
            assert output.read_bytes()[:4] in (b"BLEN", bytes.fromhex("28b52ffd"))  # plain, or compressed as by 5.2
        else:
            assert run(["decompress", str(output), "map.npz", "--output", "back.npz"]).returncode == 0

    def test_that_are_closed_where_something_is_wrong(self, here: Path) -> None:
        quoted = " ".join(f"'{part}'" for part in [*PROGRAM, *INTERPOLATE, "--report", "new.npz"])
        done = subprocess.run(["sh", "-c", f"{quoted} 2>&-"], capture_output=True, timeout=300)
        assert (done.returncode, done.stdout, done.stderr) == (2, b"", b"")

    @pytest.mark.parametrize("arguments", [COMPRESS, ["--help"], ["--version"], ["bake", "--help"]])
    def test_that_nobody_reads(self, arguments: list[str], here: Path) -> None:
        reading, writing = os.pipe()
        os.close(reading)
        try:
            done = run(arguments, stdout=writing, stderr=subprocess.PIPE)
        finally:
            os.close(writing)
        if arguments == COMPRESS:
            said = done.stderr.decode().strip()
            assert done.returncode == 1
            assert said == "qc3d: Standard output cannot be written: Broken pipe; all files are complete."
            assert run(["decompress", "new.qc3d", "map.npz", "--output", "back.npz"]).returncode == 0
        else:
            assert done.stderr == b""

    def test_that_nobody_reads_where_something_is_wrong(self, here: Path) -> None:
        reading, writing = os.pipe()
        os.close(reading)
        try:
            done = run([*INTERPOLATE, "--report", "new.npz"], stdout=subprocess.PIPE, stderr=writing)
        finally:
            os.close(writing)
        assert (done.returncode, done.stdout) == (2, b"")

    def test_on_a_disk_that_is_full(self, small_disk: Path, here: Path) -> None:
        with (small_disk / "said").open("wb") as said:
            (small_disk / "ballast").write_bytes(bytes(os.statvfs(small_disk).f_bavail * 4096))
            done = run(COMPRESS, stdout=said, stderr=subprocess.PIPE)
        assert done.returncode == 1
        said = done.stderr.decode().strip()
        assert said == "qc3d: Standard output cannot be written: No space left on device; all files are complete."

    def test_that_do_not_know_a_letter(self, here: Path) -> None:
        environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
        done = run(["compress", "m\u00e4p.npz", *COMPRESS[2:]], env=environment, capture_output=True)
        assert done.returncode == 2
        assert is_sentence(done.stderr.decode().strip())
        done = run(["reproduce", "--figure", "4", "--output", "found"], env=environment, capture_output=True)
        assert (done.returncode, done.stderr) == (0, b"")


LIMITED = """
import resource, sys
from qc3d_addon.cli.main import main
if "bake" in sys.argv:
    import bpy, qc3d_addon.blender.bake.run
{lines}
sys.exit(main())
"""


def limited(lines: str, arguments: list[str]) -> tuple[int, str]:
    """Run the command with its libraries loaded and then a limit."""
    program = LIMITED.format(lines=lines)
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=300)
    return done.returncode, done.stderr.strip()


class TestLimits:
    @pytest.mark.parametrize("free", range(4))
    @pytest.mark.parametrize("name", ["interpolate", "interpolate's report", "bake", "compress"])
    def test_of_open_files(self, name: str, free: int, here: Path) -> None:
        """Whichever file is the one too many: the command is done, or one sentence says why not."""
        lines = "import os\nused = max(int(n) for n in os.listdir('/dev/fd')) + 1\n"
        lines += f"resource.setrlimit(resource.RLIMIT_NOFILE, (used + {free},) * 2)"
        output = here / f"new{COMMANDS[name][1]}"
        status, said = limited(lines, command(name, output))
        if status == 0:
            assert output.exists()
            return
        assert status == 2
        assert is_sentence(said)
        assert not output.exists()
        assert not [path for path in here.iterdir() if path.name.startswith(".")]
        if free == 0:
            assert "Too many open files" in said
            assert "ulimit -n" in said

    @pytest.mark.parametrize("name", ["interpolate", "bake", "compress"])
    def test_of_the_size_of_files(self, name: str, here: Path) -> None:
        output = here / f"new{COMMANDS[name][1]}"
        output.write_text("earlier")
        lines = "resource.setrlimit(resource.RLIMIT_FSIZE, (140, 140))"
        status, said = limited(lines, command(name, output))
        assert status == 2
        assert is_sentence(said)
        assert "cannot be written: File too large; raise the limit on the size of files (ulimit -f)" in said
        assert output.read_text() == "earlier"
        assert not [path for path in here.iterdir() if path.name.startswith(".")]

    def test_of_threads(self, here: Path) -> None:
        lines = (
            "import threading\n"
            "from qc3d_addon.solver.support import threads\n"
            "threads.thread_count = lambda: 2\n"
            "def none(self): raise RuntimeError(\"can't start new thread\")\n"
            "threading.Thread.start = none"
        )
        status, said = limited(lines, [*NATURAL, "--engine", "delaunay", "--frames", "9"])
        assert status == 2
        assert said == "qc3d: The system allows no more threads; close some programs, or raise the limit (ulimit -u)."

    @pytest.mark.skipif(unavailable_reason() is not None, reason=f"tetwild: {unavailable_reason()}")
    def test_of_processes(self, here: Path) -> None:
        lines = (
            "import errno, os, subprocess\n"
            "def none(*_, **__): raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))\n"
            "subprocess.Popen = none"
        )
        arguments = [*NATURAL, "--frames", "1", "--quality", "normal"]
        status, said = limited(lines, [*arguments, "--engine", "tetwild"])
        assert status == 2
        assert is_sentence(said)
        assert "Resource temporarily unavailable; close some programs, or raise the limit on processes" in said
        status, said = limited(lines, [*arguments, "--engine", "auto"])
        assert status == 0
        assert "filled by the engine delaunay" in said


SHADOWING = (
    "import os, sys\n"
    "with open({log!r}, 'a') as log:\n"
    "    log.write(__file__ + ' ' + ' '.join(sys.orig_argv) + chr(10))\n"
)
LIBRARIES = ("numpy", "scipy", "bpy", "tqdm", "meshio", "pytetwild", "json", "random", "secrets", "zipfile", "csv")


class TestNamesOfLibraries:
    @pytest.fixture
    def log(self, here: Path, tmp_path: Path) -> Path:
        """A file that every module in the working folder writes to when it is run."""
        log = tmp_path / "log"
        log.touch()
        for name in LIBRARIES:
            (here / f"{name}.py").write_text(SHADOWING.format(log=str(log)))
        (here / "pytetwild").mkdir()
        (here / "PyfTetWildWrapper.py").write_text(SHADOWING.format(log=str(log)))
        for program in ("python", "python3", "python3.11", "python3.13", "taskkill", "sh", "ldconfig", "gcc"):
            (here / program).write_text(f"#!/bin/sh\necho $0 $* >> {log}\n")
            (here / program).chmod(0o755)
        return log

    @pytest.mark.parametrize("engine", ["auto", "delaunay"])
    def test_in_the_working_folder(self, engine: str, log: Path, here: Path) -> None:
        arguments = ["interpolate", "bar.npz", *KEYS, "--frames", "1", "--quality", "normal", "--engine", engine]
        environment = {**os.environ, "PATH": f"{here}:.::{os.environ['PATH']}"}
        report = ["--output", "new.npz", "--report", "report.json"]
        done = run([*arguments, *report], env=environment, capture_output=True)
        assert (done.returncode, done.stderr) == (0, b"")
        assert log.read_text() == ""
        if engine == "auto" and unavailable_reason() is None:
            assert json.loads(Path("report.json").read_text())["engine"] == "tetwild"
        assert run(["bake", *command("bake", "new.blend")[1:]], env=environment, capture_output=True).returncode == 0
        assert log.read_text() == ""

    def test_in_the_folder_of_the_bakes_process(self, log: Path, here: Path, tmp_path: Path) -> None:
        """The child processes that Blender starts, in whatever folder it was started."""
        program = (
            "import sys\nfrom pathlib import Path\n"
            "root = sys.argv[1]\n"
            "sys.path[:] = [root] + [entry for entry in sys.path if entry]\n"
            "from tests.worker.test_client import small_task\n"
            "from tests.attacks.test_endings import _with_tetwild\n"
            "from qc3d_addon.solver.meshing.tetwild_loading import unavailable_reason\n"
            "from qc3d_addon.worker import client\n"
            "assert client.run(small_task() if unavailable_reason() else _with_tetwild()).bake is not None\n"
        )
        root = str(Path(__file__).resolve().parents[2])
        environment = {**os.environ, "PATH": f"{here}:.::{os.environ['PATH']}", "PYTHONPATH": str(here / "none")}
        command = [sys.executable, "-P", "-c", program, root]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        assert log.read_text() == ""

    def test_on_the_python_path_of_children(self, here: Path, tmp_path: Path) -> None:
        """The parent has to take what its user says; its children do not."""
        log, folder = tmp_path / "log", tmp_path / "path"
        folder.mkdir()
        (folder / "sitecustomize.py").write_text(SHADOWING.format(log=str(log)))
        arguments = ["interpolate", "bar.npz", *KEYS, "--frames", "1", "--quality", "normal", "--engine", "auto"]
        environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONSTARTUP": str(folder / "sitecustomize.py")}
        done = run([*arguments, "--output", "new.npz"], env=environment, capture_output=True)
        assert (done.returncode, done.stderr) == (0, b"")
        (line,) = log.read_text().splitlines()
        assert "qc3d_addon" in line

    @pytest.mark.parametrize(
        "text",
        ["raise ImportError('built for another Python')", "this is no Python", "import sys\nsys.nothing", "del int.x"],
    )
    def test_a_library_that_does_not_load(self, text: str, here: Path, tmp_path: Path) -> None:
        """As where PYTHONPATH is set for another program, with libraries for its Python."""
        folder = tmp_path / "path"
        (folder / "numpy").mkdir(parents=True)
        (folder / "numpy" / "__init__.py").write_text(text)
        done = run(INTERPOLATE, env={**os.environ, "PYTHONPATH": str(folder)}, capture_output=True, text=True)
        assert done.returncode == 2
        said = str(done.stderr).strip()
        assert is_sentence(said)
        assert "Its libraries do not load: " in said
        assert f"unset PYTHONPATH, which is '{folder}', or install QC3D again" in said

    def test_the_checkout_itself_is_found_without_being_installed(self, here: Path, tmp_path: Path) -> None:
        """The working folder may be the one that holds the package: its other parts are found there, libraries not."""
        root = Path(__file__).resolve().parents[2]
        for name in ("qc3d_addon", "qc3d_paper"):
            shutil.copytree(root / name, here / name)
        shutil.copy(root / "blender_manifest.toml", here)
        (here / "numpy.py").write_text("raise SystemExit('the wrong numpy')")
        done = run(["analyze", "map.npz", "--output", "found"], cwd=here, capture_output=True)
        assert (done.returncode, done.stderr) == (0, b"")
