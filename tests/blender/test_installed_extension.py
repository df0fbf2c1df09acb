# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The package for this platform, installed as by a user: our sources are not on the path, the user folder is empty."""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

import build_extension

SCRIPT = Path(__file__).with_name("use_installed.py")
PLATFORMS = {("linux", "x86_64"): "linux-x64", ("win32", "AMD64"): "windows-x64"}  # where both engines run
OLDEST_NUMPY = {"cp311": (1, 24), "cp313": (2, 2)}  # of the Blenders with this Python


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package, built with the real wheels."""
    name = PLATFORMS.get((sys.platform, platform.machine()))
    if name is None:
        pytest.skip(f"no package has both engines for {sys.platform} on {platform.machine()}")
    try:
        return build_extension.build(name, tmp_path_factory.mktemp("dist"), [])
    except build_extension.UnreachableError as error:
        pytest.skip(f"the wheels to bundle are not to be had: {error}")


@pytest.fixture(scope="session")
def blender(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Python with Blender's module and what that requires, no more; its user folder is ``user`` beside it."""
    folder = tmp_path_factory.mktemp("blender")
    venv.create(folder / "python", symlinks=sys.platform != "win32")
    (site_packages,) = (folder / "python").glob("[lL]ib/**/site-packages")
    waiting, linked = ["bpy"], set()
    while waiting:
        name = waiting.pop()
        if name in linked:
            continue
        linked.add(name)
        try:
            distribution = metadata.distribution(name)
        except metadata.PackageNotFoundError:
            continue  # required on other systems only
        for top in {file.parts[0] for file in distribution.files or ()} - {"..", "__pycache__"}:
            source = Path(str(distribution.locate_file(top))).resolve()
            if name == "bpy" or source.is_file():
                (site_packages / top).symlink_to(source)
            else:  # the folder of numpy is handed to child processes: it must not lead back to one with scipy
                shutil.copytree(source, site_packages / top)
        required = [text for text in distribution.requires or () if "extra ==" not in text]
        waiting += [match[0] for text in required if (match := re.match(r"[\w.-]+", text))]
    assert not linked & {"scipy", "pytetwild"}
    (folder / "user").mkdir()
    return folder


def run(blender: Path, *arguments: str) -> dict[str, Any]:
    (python,) = (*(blender / "python").glob("bin/python"), *(blender / "python").glob("Scripts/python.exe"))
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    environment["BLENDER_USER_RESOURCES"] = str(blender / "user")
    command = [str(python), str(SCRIPT), *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=180)
    assert done.returncode == 0, done.stdout + done.stderr
    # Blender's own lines may come before it or after it: they are buffered apart.
    (result,) = (line for line in done.stdout.splitlines() if line.startswith("RESULT "))
    return json.loads(result.removeprefix("RESULT "))


def test_the_wheels_run_with_the_oldest_numpy_of_their_blenders(package: Path) -> None:
    with zipfile.ZipFile(package) as archive:
        for name in (name for name in archive.namelist() if name.startswith("wheels/scipy-")):
            with archive.open(name) as stream, zipfile.ZipFile(stream) as wheel:
                (path,) = (path for path in wheel.namelist() if path.endswith(".dist-info/METADATA"))
                required = re.search(r"^Requires-Dist: numpy.*>=(\d+)\.(\d+)", wheel.read(path).decode(), re.MULTILINE)
            assert required is not None
            assert (int(required[1]), int(required[2])) <= OLDEST_NUMPY[name.split("-")[2]]


def test_it_installs_bakes_and_goes_again(package: Path, blender: Path) -> None:
    """One test, since each step needs the one before."""
    assert run(blender, "install", str(package)) == {"enabled": True, "slow imports": []}
    used = run(blender, "use")
    assert used["added"]["properties"] == ["Object.qc3d"]
    assert {"QC3D_OT_bake_inbetweens", "QC3D_PT_inbetweens"} <= set(used["added"]["types"])
    assert used["left behind"] == used["left behind after uninstalling"] == {}
    assert used["slow imports"] == []  # enabling must not wait for the libraries
    keys = ["Basis_to_Lean_33", "Basis_to_Lean_67", "Basis_to_Lean_100"]
    for engine in ("tetwild", "delaunay"):
        assert used["baked"][engine]["status"] == ["FINISHED"]
        assert used["baked"][engine]["keys"] == keys
    assert used["notice"] is None
    assert not used["pytetwild imported"]  # its package needs pyvista; only a child process loads the module inside
    wheels = blender / "user" / "extensions" / ".local"
    assert str(wheels) in used["libraries"]["scipy"]
    assert str(wheels) not in used["libraries"]["numpy"]
    assert used["modules after uninstalling"] == []  # Blender keeps them of an add-on that is only disabled
    assert used["files after uninstalling"] == []
