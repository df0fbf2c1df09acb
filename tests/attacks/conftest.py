# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by the attacks: a user without rights, a small disk, small inputs, and the command as a program.

Everything happens in a folder of the test, never in the machine's devices or its folder for temporary files.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.cli import main
from qc3d_addon.solver.maps.files import STRETCH, TARGET, TetFile, write_tets
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.maps.representation import upper_triangle
from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid

from .commands import KEYS, is_alive

NOBODY = 65534
PROGRAM = [sys.executable, "-m", "qc3d_addon"]

Run = Callable[..., tuple[int, str]]


@pytest.fixture(autouse=True)
def temporary(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder for temporary files, of this process and of those that it starts; empty at the start."""
    folder = tmp_path_factory.mktemp("temporary")
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs the command in this process: its exit status, and what it said on standard error."""

    def run_command(*arguments: str | Path) -> tuple[int, str]:
        capsys.readouterr()
        status = main.main([str(argument) for argument in arguments])
        return status, capsys.readouterr().err.strip()

    return run_command


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Path]:
    """A folder that anybody may get to, which the folders of pytest are not."""
    folder = Path(tempfile.mkdtemp(dir=tmp_path.anchor + "tmp" if os.name == "posix" else None))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


@pytest.fixture
def unprivileged(place: Path) -> Iterator[Path]:
    """A folder of a user who may not do everything, which this process is during the test."""
    folder = place / "home"
    folder.mkdir()
    if not hasattr(os, "geteuid"):
        pytest.skip("users as Linux and macOS have them")
    before = os.geteuid()
    if before == 0:
        os.chown(folder, NOBODY, -1)
        os.seteuid(NOBODY)
    yield folder
    os.seteuid(before)
    for path in place.rglob("*"):
        if path.is_dir() and not path.is_symlink():
            path.chmod(0o700)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of one megabyte."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = shutil.which("mount")
    made = mount and subprocess.run([mount, "-t", "tmpfs", "-o", "size=1m", "none", str(folder)], capture_output=True)
    if not made or made.returncode:
        pytest.skip("no disk can be mounted here")
    yield folder
    if subprocess.run(["umount", str(folder)], capture_output=True).returncode:
        subprocess.run(["umount", "-l", str(folder)], check=True)
        raise AssertionError(f"something in {folder} is still open")


@pytest.fixture(scope="session")
def inputs(bar: dict[str, np.ndarray], bar_scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an input for every command."""
    folder = tmp_path_factory.mktemp("inputs")
    leaned = bar["V0"] + bar["V0"][:, 2:] * [0.0, 0.1, 0.0]
    np.savez(folder / "bar.npz", **(bar | {"shape_names": np.array(["straight", "bent", "leaned"]), "V2": leaned}))
    shutil.copy(bar_scene, folder / "bar.blend")
    mesh = kuhn_grid(2)
    values = mesh.points + 0.1 * np.sin(np.pi * mesh.points) * mesh.points[:, [1, 2, 0]]
    stretch = upper_triangle(Mapping(mesh, values).stretch)
    write_tets(folder / "map.npz", TetFile(mesh.points, mesh.tets, {TARGET: values}, {STRETCH: stretch}))
    for command in (
        ["interpolate", "bar.npz", *KEYS, "--frames", "0", "--mode", "straight", "--output", "frames.npz"],
        ["compress", "map.npz", "--modes", "3", "--scheme", "published", "--output", "map.qc3d"],
        ["compress", "frames.npz", "--modes", "3", "--output", "frames.qc3d"],
        ["bake", "bar.blend", "--object", "Bar", "--on-key", "Bent", "--frames", "1", "--output", "baked.blend"],
    ):
        subprocess.run([*PROGRAM, *command], cwd=folder, check=True, capture_output=True, timeout=300)
    return folder


@pytest.fixture
def here(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder of the test, with copies of the inputs."""
    folder = tmp_path / "here"
    shutil.copytree(inputs, folder)
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def killed() -> Iterator[list[int]]:
    """Numbers of processes to kill at the end, whatever the test found."""
    numbers: list[int] = []
    yield numbers
    for number in numbers:
        if is_alive(number):
            os.kill(number, signal.SIGKILL)
