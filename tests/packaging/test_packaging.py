# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A single version number, and a wheel with the packages and nothing else."""

from __future__ import annotations

import subprocess
import sys
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


def test_the_wheel_holds_every_module_and_nothing_else(repository: Path, wheel: zipfile.ZipFile) -> None:
    packages = (repository / "qc3d_addon", repository / "qc3d_paper")
    modules = {str(path.relative_to(repository)) for package in packages for path in package.rglob("*.py")}
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert packed == modules
    assert any(name.endswith("LICENSE") for name in wheel.namelist())


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
