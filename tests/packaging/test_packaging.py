# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A single version number, and a wheel with the packages and nothing else."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def wheel(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    run = subprocess.run(command, cwd=repository, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stdout + run.stderr
    (path,) = folder.glob("*.whl")
    return zipfile.ZipFile(path)


def test_the_manifest_alone_holds_the_version(repository: Path, wheel: zipfile.ZipFile) -> None:
    version = tomllib.loads((repository / "blender_manifest.toml").read_text())["version"]
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    assert "version" not in project
    assert metadata.version("qc3d") == version
    assert Path(str(wheel.filename)).name.startswith(f"qc3d-{version}-")


def test_the_wheel_holds_every_module_the_demo_and_nothing_else(repository: Path, wheel: zipfile.ZipFile) -> None:
    packages = (repository / "qc3d_addon", repository / "qc3d_paper")
    modules = {str(path.relative_to(repository)) for package in packages for path in package.rglob("*.py")}
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert packed == modules | {"qc3d_addon/demo/figure.blend"}
    assert any(name.endswith("LICENSE") for name in wheel.namelist())


@pytest.mark.slow
def test_the_source_package_makes_a_wheel_that_runs(repository: Path, tmp_path: Path) -> None:
    """As pip does it: unpack the sdist, build the wheel from it, install that without its requirements, and bake."""
    run = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)]
    subprocess.run(run, cwd=repository, check=True, capture_output=True)
    (source,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(source) as archive:
        archive.extractall(tmp_path / "source", filter="data")
    (unpacked,) = (tmp_path / "source").iterdir()
    for needed in ("README.md", "LICENSE", "CHANGELOG.md", "tests/conftest.py", "assets/make_assets.py"):
        assert (unpacked / needed).is_file()
    subprocess.run([*run[:5], "wheel", "-d", str(tmp_path)], cwd=unpacked, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    target = tmp_path / "installed"
    install = ["install", "--quiet", "--no-deps", "--no-index", "--target", str(target), str(wheel)]
    subprocess.run([sys.executable, "-m", "pip", *install], check=True, capture_output=True)
    script = (
        f"import sys; sys.path.insert(0, {str(target)!r})\n"
        "import numpy as np, qc3d_addon as qc3d\n"
        f"assert qc3d.__file__.startswith({str(target)!r}), qc3d.__file__\n"
        "corners = np.array([[0., 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])\n"
        "faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])\n"
        "print(len(qc3d.fit(corners, 1.5 * corners, faces).inbetweens(2).frames))\n"
    )
    ran = subprocess.run([sys.executable, "-I", "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert ran.stdout.strip() == "4", ran.stderr


def test_the_command_is_installed() -> None:
    (script,) = metadata.entry_points(group="console_scripts", name="qc3d")
    assert callable(script.load())


def test_every_source_file_names_its_licence(repository: Path) -> None:
    listed = subprocess.run(["git", "ls-files", "*.py", "*.toml"], cwd=repository, capture_output=True, text=True)
    if listed.returncode != 0:
        pytest.skip("not a git checkout, so the project's own files are not known")
    missing = [
        name
        for name in listed.stdout.splitlines()
        if "SPDX-License-Identifier: GPL-3.0-or-later" not in (repository / name).read_text()[:300]
    ]
    assert missing == []
