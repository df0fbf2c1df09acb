# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The builder of extension packages, with small wheels made here: contents of packages, and what fails a build."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import shutil
import sys
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

import build_extension
import slim_wheel
from build_extension import PLATFORMS, BuildError, Wheel

SCIPY = ("scipy-1.0-cp311-cp311-manylinux2014_x86_64.whl", "scipy-2.0-cp313-cp313-manylinux_2_28_x86_64.whl")
TETWILD = "pytetwild-1.0-cp312-abi3-manylinux2014_x86_64.whl"


@pytest.fixture(scope="module")
def validator() -> ModuleType:
    """Blender's own program for extensions."""
    bpy_spec = importlib.util.find_spec("bpy")
    assert bpy_spec is not None
    assert bpy_spec.origin is not None
    (path,) = Path(bpy_spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    spec = importlib.util.spec_from_file_location("blender_ext", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["blender_ext"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def small_wheels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of three small wheels for Linux, and pins that name them."""
    cache = tmp_path / "cache"
    cache.mkdir()
    for file in (*SCIPY, TETWILD):
        make_wheel(cache / file)
    monkeypatch.setattr(build_extension, "CACHE", cache)
    pin_all(cache, tmp_path / "pins.sha256", monkeypatch)
    return cache


def make_wheel(path: Path, licence: str = "LICENSE.txt") -> None:
    package, version = path.name.split("-")[:2]
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{package}/__init__.py", f"name = {path.name!r}\n")
        archive.writestr(f"{package}-{version}.dist-info/{licence}", f"The licence of {package}\n")


def pin_all(cache: Path, pins: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in sorted(cache.iterdir())]
    pins.write_text("# wheels\n" + "".join(lines), encoding="utf-8")
    monkeypatch.setattr(build_extension, "PINS", pins)


def test_every_platform_gets_one_wheel_of_scipy_for_each_of_its_pythons() -> None:
    for platform, (_, pythons) in PLATFORMS.items():
        for python in pythons:
            served = [wheel.parts[0] for wheel in build_extension.read_pins() if wheel.serves(platform, python)]
            # Two wheels of one package for one Python would leave the choice to their names.
            assert served.count("scipy") == 1
            assert served.count("pytetwild") <= 1
            assert set(served) <= {"scipy", "pytetwild"}


def test_blender_agrees_which_platform_a_wheel_is_for(validator: ModuleType) -> None:
    agrees = validator.blender_platform_compatible_with_wheel_platform_from_filepath
    for wheel in build_extension.read_pins():
        python = {"cp311": "3.11", "cp312": "3.12", "cp313": "3.13", "cp314": "3.14"}[wheel.parts[2]]
        for platform in PLATFORMS:
            assert wheel.serves(platform, python) == agrees(platform, wheel.file)


@pytest.mark.parametrize(
    ("file", "python", "loads"),
    [
        (SCIPY[0], "3.11", True),
        (SCIPY[0], "3.13", False),
        (TETWILD, "3.11", False),
        (TETWILD, "3.12", True),
        (TETWILD, "3.14", True),
    ],
)
def test_a_wheel_with_the_stable_interface_serves_later_pythons_too(file: str, python: str, loads: bool) -> None:
    assert Wheel(file, "").serves("linux-x64", python) is loads
    assert not Wheel(file, "").serves("macos-x64", python)


@pytest.mark.usefixtures("small_wheels")
def test_the_package_holds_the_addon_the_wheels_and_the_licences(repository: Path, tmp_path: Path) -> None:
    path = build_extension.build("linux-x64", tmp_path / "dist", [])
    stated = tomllib.loads((repository / "blender_manifest.toml").read_text())
    assert path.name == f"qc3d-{stated['version']}-linux-x64.zip"
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        licence = archive.read("licences/scipy-2.0-cp313/scipy-2.0.dist-info/LICENSE.txt")
    wheels = [TETWILD, *SCIPY]
    assert manifest == stated | {"platforms": ["linux-x64"], "wheels": [f"./wheels/{wheel}" for wheel in wheels]}
    assert {f"wheels/{wheel}" for wheel in wheels} == {name for name in names if name.startswith("wheels/")}
    package = repository / "qc3d_addon"
    assert {file.relative_to(package).as_posix() for file in package.rglob("*.py")} <= names
    assert {"LICENSE", "licences/extension_notices.txt"} <= names
    assert licence == b"The licence of scipy\n"
    assert not [name for name in names if "__pycache__" in name]


@pytest.mark.usefixtures("small_wheels")
def test_wheels_are_packed_without_their_tests_and_say_so(small_wheels: Path, tmp_path: Path) -> None:
    wheel = small_wheels / "a-1.0-cp313-cp313-any.whl"
    kept = {"a/__init__.py": "", "a/_fast.so": "", "a/tests/LICENSE": "", "a-1.0.dist-info/METADATA": ""}
    left = {"a/tests/__init__.py": "", "a/sub/tests/data/x.npz": "", "a/_fast.pyx": "", "a/_fast.h": ""}
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, text in (kept | left).items():
            archive.writestr(name, text)
        record = [f"{name},sha256=abc,0" for name in kept | left] + ["a-1.0.dist-info/RECORD,,"]
        archive.writestr("a-1.0.dist-info/RECORD", "\n".join(record) + "\n")
    slim = slim_wheel.slimmed(wheel, tmp_path)
    with zipfile.ZipFile(slim) as archive:
        assert set(archive.namelist()) == {*kept, "a-1.0.dist-info/RECORD"}
        lines = archive.read("a-1.0.dist-info/RECORD").decode().splitlines()
    assert {line.split(",")[0] for line in lines} == {*kept, "a-1.0.dist-info/RECORD"}
    assert slim.name == wheel.name


@pytest.mark.usefixtures("small_wheels")
def test_the_same_content_makes_the_same_package(tmp_path: Path) -> None:
    first, second = (build_extension.build("linux-x64", tmp_path / name, []) for name in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()


def test_a_test_build_has_wheels_for_one_more_python(
    small_wheels: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    extra = "scipy-2.0-cp314-cp314-manylinux_2_28_x86_64.whl"
    make_wheel(small_wheels / extra)
    pin_all(small_wheels, tmp_path / "pins.sha256", monkeypatch)
    path = build_extension.build("linux-x64", tmp_path, ["3.14"])
    assert path.name.endswith("-python3.14-linux-x64.zip")
    assert f"wheels/{extra}" in zipfile.ZipFile(path).namelist()
    plain = build_extension.build("linux-x64", tmp_path, [])
    assert f"wheels/{extra}" not in zipfile.ZipFile(plain).namelist()


@pytest.mark.usefixtures("small_wheels")
@pytest.mark.parametrize(
    ("platform", "extra", "message"),
    [
        ("linux-x64", ["3.14"], "has no scipy for Python 3.14 on linux-x64"),
        ("macos-arm64", [], "has no scipy for Python 3.11 on macos-arm64"),
    ],
)
def test_no_package_without_scipy(platform: str, extra: list[str], message: str, tmp_path: Path) -> None:
    with pytest.raises(BuildError, match=message):
        build_extension.build(platform, tmp_path / "dist", extra)


def refused(tmp_path: Path, message: str) -> None:
    with pytest.raises(BuildError, match=message):
        build_extension.build("linux-x64", tmp_path / "dist", [])
    assert list((tmp_path / "dist").iterdir()) == []


@pytest.mark.usefixtures("small_wheels")
@pytest.mark.parametrize(
    ("lost", "message"),
    [
        ("wheels/scipy", "is missing, added or changed"),
        ("wheels/pytetwild", "is missing, added or changed"),
        ("licences/scipy-2.0", "lacks licences/scipy-2.0-cp313"),
        ("LICENSE", "lacks LICENSE"),
        ("__init__.py", "lacks __init__.py"),
    ],
)
def test_a_package_that_lost_something_fails_the_build(
    lost: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add = build_extension._add

    def lose(archive: zipfile.ZipFile, name: str, *content: object) -> None:
        if not name.startswith(lost):
            add(archive, name, *content)

    monkeypatch.setattr(build_extension, "_add", lose)
    refused(tmp_path, message)


@pytest.mark.usefixtures("small_wheels")
def test_a_manifest_that_lost_its_wheels_fails_the_build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = build_extension.manifest
    monkeypatch.setattr(build_extension, "manifest", lambda platform, wheels: whole(platform, wheels[1:]))
    refused(tmp_path, "manifest in .* is not the project's with the platform and the wheels added")


@pytest.mark.usefixtures("small_wheels")
def test_blenders_validator_has_the_last_word(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = tmp_path / "project"
    shutil.copytree(repository / "qc3d_addon", project / "qc3d_addon", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(repository / "LICENSE", project)
    text = (repository / "blender_manifest.toml").read_text().replace('"Rigging"', '"Riging"')
    (project / "blender_manifest.toml").write_text(text)
    monkeypatch.setattr(build_extension, "REPOSITORY", project)
    refused(tmp_path, "validator refuses .*Riging")


def test_numpy_is_refused(small_wheels: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make_wheel(small_wheels / "numpy-2.0-cp313-cp313-manylinux_2_28_x86_64.whl")
    pin_all(small_wheels, tmp_path / "pins.sha256", monkeypatch)
    refused(tmp_path, "Blender brings its own numpy")


def test_a_wheel_without_a_licence_is_refused(
    small_wheels: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_wheel(small_wheels / TETWILD, licence="METADATA")
    pin_all(small_wheels, tmp_path / "pins.sha256", monkeypatch)
    refused(tmp_path, "holds no licence text")


def test_a_wheel_that_is_not_the_pinned_one_is_refused(small_wheels: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(small_wheels / SCIPY[1], "a") as archive:
        archive.writestr("scipy/more.py", "")
    with pytest.raises(BuildError, match="is not the wheel that"):
        build_extension.build("linux-x64", tmp_path / "dist", [])


def test_a_registry_out_of_reach_is_told_apart(
    small_wheels: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (small_wheels / SCIPY[0]).unlink()
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")  # nothing listens there
    monkeypatch.delenv("PIP_EXTRA_INDEX_URL", raising=False)
    monkeypatch.delenv("PIP_FIND_LINKS", raising=False)
    with pytest.raises(build_extension.UnreachableError, match="the package registry cannot be reached"):
        build_extension.build("linux-x64", tmp_path / "dist", [])
    monkeypatch.delenv("PIP_INDEX_URL")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(BuildError, match="cannot be downloaded: ERROR: No matching distribution") as error:
        build_extension.build("linux-x64", tmp_path / "dist", [])
    assert not isinstance(error.value, build_extension.UnreachableError)


@pytest.mark.usefixtures("small_wheels")
def test_the_command_prints_sizes_and_says_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = ["--output", str(tmp_path)]
    assert build_extension.main(["--platform", "linux-x64", *output]) == 0
    assert re.search(r"linux-x64\.zip  \d+\.\d MB", capsys.readouterr().out)
    assert build_extension.main(["--platform", "windows-x64", *output]) == 2
    assert "has no scipy for Python 3.11 on windows-x64" in capsys.readouterr().err
