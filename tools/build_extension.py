# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the extension packages, one for each platform, including the wheels that Blender's Python lacks.

The wheels are pinned in ``tools/extension_wheels.sha256``, downloaded once into a cache, and packed without tests.
Every package is read back, compared with what it should contain, and checked by Blender's own validator; a package
that fails is removed.

    python tools/build_extension.py [--platform linux-x64] [--extra-python 3.14]
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from slim_wheel import slimmed

REPOSITORY = Path(__file__).resolve().parents[1]
PINS = Path(__file__).with_name("extension_wheels.sha256")
NOTICES = Path(__file__).with_name("extension_notices.txt")
CACHE = REPOSITORY / ".wheels"
MANIFEST = "blender_manifest.toml"

# For each of Blender's platforms: the platform tags of wheels, and the Python versions of the supported Blenders.
# Blender 4.5 is the last one for Intel Macs.
PLATFORMS = {
    "linux-x64": (r"manylinux.*_x86_64", ("3.11", "3.13")),
    "windows-x64": (r"win_amd64", ("3.11", "3.13")),
    "windows-arm64": (r"win_arm64", ("3.11", "3.13")),
    "macos-arm64": (r"macosx_.*_arm64", ("3.11", "3.13")),
    "macos-x64": (r"macosx_.*_x86_64", ("3.11",)),
}
_REQUIRED = "scipy"  # nothing runs without scipy; without pytetwild, the engine delaunay still works
_LICENCE_NAME = re.compile(r"(licen[cs]e|copying|notice)", re.IGNORECASE)


class BuildError(Exception):
    """No package can be built; the message is a sentence that says why."""


class UnreachableError(BuildError):
    """The package registry cannot be reached."""


@dataclass(frozen=True)
class Wheel:
    """A pinned wheel.

    Parameters
    ----------
    file : str
        File name of the wheel: package, version, Python, ABI and platform, separated by hyphens.
    sha256 : str
        Its hash in hexadecimal digits.
    """

    file: str
    sha256: str

    @property
    def parts(self) -> tuple[str, str, str, str, str]:
        """Package, version, Python tag, ABI tag, platform tag."""
        package, version, python, abi, platform = self.file.removesuffix(".whl").split("-")
        return package, version, python, abi, platform

    def serves(self, platform: str, python: str) -> bool:
        """Whether a Python version such as "3.13" can load the wheel on one of Blender's platforms."""
        _, _, tag, abi, wheel_platform = self.parts
        oldest = (int(tag[2]), int(tag[3:]))
        wanted = tuple(int(number) for number in python.split("."))
        loads = wanted >= oldest if abi == "abi3" else wanted == oldest
        return loads and re.fullmatch(PLATFORMS[platform][0], wheel_platform) is not None


def main(argv: list[str] | None = None) -> int:
    """Build the packages that the command line asks for, and print their sizes."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--platform", action="append", choices=list(PLATFORMS), help="only this one; once for each")
    parser.add_argument(
        "--extra-python",
        action="append",
        default=[],
        metavar="3.X",
        help="a test build with wheels for one more Python, which the pins must have",
    )
    parser.add_argument("--output", type=Path, default=REPOSITORY / "dist", help="the folder (default: dist)")
    arguments = parser.parse_args(argv)
    try:
        for platform in arguments.platform or PLATFORMS:
            path = build(platform, arguments.output, arguments.extra_python)
            print(f"{path}  {path.stat().st_size / 1e6:.1f} MB")
    except BuildError as error:
        print(f"build_extension: {error}", file=sys.stderr)
        return 2
    return 0


def build(platform: str, folder: Path, extra_pythons: list[str]) -> Path:
    """Download the wheels of one platform, write its package into ``folder`` and check it; raises BuildError."""
    wheels = chosen(read_pins(), platform, extra_pythons)
    fetched = [fetch(wheel) for wheel in wheels]
    version = tomllib.loads((REPOSITORY / MANIFEST).read_text(encoding="utf-8"))["version"]
    kind = "".join(f"-python{python}" for python in extra_pythons)
    path = folder / f"qc3d-{version}{kind}-{platform}.zip"
    folder.mkdir(parents=True, exist_ok=True)
    unchecked = path.with_name(f".{path.name}")
    try:
        with tempfile.TemporaryDirectory() as slim:
            files = [slimmed(wheel, Path(slim)) for wheel in fetched]
            write(unchecked, platform, files)
            check(unchecked, platform, files)
        validate(unchecked)
        unchecked.replace(path)
    finally:
        unchecked.unlink(missing_ok=True)
    return path


def read_pins() -> list[Wheel]:
    """All pinned wheels."""
    lines = PINS.read_text(encoding="utf-8").splitlines()
    return [Wheel(file, sha256) for sha256, file in (line.split() for line in lines if line and line[0] != "#")]


def chosen(pins: list[Wheel], platform: str, extra_pythons: list[str]) -> list[Wheel]:
    """The wheels for one platform's Python versions; raises BuildError if one of these would have no scipy."""
    pythons = [*PLATFORMS[platform][1], *extra_pythons]
    for python in pythons:
        if not any(wheel.parts[0] == _REQUIRED and wheel.serves(platform, python) for wheel in pins):
            raise BuildError(f"{PINS.name} has no {_REQUIRED} for Python {python} on {platform}; add its wheel there.")
    return [wheel for wheel in pins if any(wheel.serves(platform, python) for python in pythons)]


def fetch(wheel: Wheel) -> Path:
    """Path of the wheel in the cache, downloaded if necessary; raises BuildError if that fails."""
    path = CACHE / wheel.file
    if not path.exists():
        package, version, python, abi, platform = wheel.parts
        tags = [f"--platform={tag}" for tag in platform.split(".")]
        only = ["--no-deps", "--only-binary=:all:", "--require-hashes", "--implementation=cp", "--retries=1"]
        CACHE.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=CACHE) as folder:  # another build may download the same wheel meanwhile
            requirement = Path(folder) / "requirement.txt"
            requirement.write_text(f"{package}=={version} --hash=sha256:{wheel.sha256}\n", encoding="utf-8")
            command = [sys.executable, "-m", "pip", "download", "--quiet", *only, f"--python-version={python[2:]}"]
            command += [f"--abi={abi}", *tags, f"--dest={folder}", f"--requirement={requirement}"]
            run = subprocess.run(command, capture_output=True, text=True)
            brought = Path(folder) / wheel.file
            if run.returncode == 0 and brought.exists():
                brought.replace(path)
        if not path.exists():
            reason = (run.stderr.strip() or "pip brought another file").splitlines()[-1]
            if re.search(r"connection|timed out|resolution", run.stderr, re.IGNORECASE):
                raise UnreachableError(f"{wheel.file} cannot be downloaded: the package registry cannot be reached.")
            raise BuildError(f"{wheel.file} cannot be downloaded: {reason}")
    if hashlib.sha256(path.read_bytes()).hexdigest() != wheel.sha256:
        raise BuildError(f"{path} is not the wheel that {PINS.name} names; remove it, so that it is downloaded again.")
    return path


def write(path: Path, platform: str, wheels: list[Path]) -> None:
    """Write the package: the add-on's files at the top level, the wheels, and all licenses."""
    code = REPOSITORY / "qc3d_addon"
    sources = sorted(file for file in code.rglob("*") if file.is_file() and "__pycache__" not in file.parts)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        _add(archive, MANIFEST, manifest(platform, [wheel.name for wheel in wheels]).encode())
        _add(archive, "LICENSE", (REPOSITORY / "LICENSE").read_bytes())
        for source in sources:
            _add(archive, source.relative_to(code).as_posix(), source.read_bytes())
        _add(archive, f"licences/{NOTICES.name}", NOTICES.read_bytes())
        for wheel in wheels:
            for name, text in licence_texts(wheel).items():
                _add(archive, f"{_licence_folder(wheel.name)}/{name}", text)
        for wheel in wheels:
            _add(archive, f"wheels/{wheel.name}", wheel.read_bytes(), zipfile.ZIP_STORED)


def manifest(platform: str, wheels: list[str]) -> str:
    """The project's manifest, with the platform and the wheels inserted before its first table."""
    text = (REPOSITORY / MANIFEST).read_text(encoding="utf-8")
    listed = "".join(f'    "./wheels/{wheel}",\n' for wheel in wheels)
    added = f'platforms = ["{platform}"]\nwheels = [\n{listed}]\n'
    table = re.search(r"^\[", text, re.MULTILINE)
    place = table.start() if table else len(text)
    return f"{text[:place]}{added}\n{text[place:]}"


def licence_texts(wheel: Path) -> dict[str, bytes]:
    """All license texts inside a wheel, by their paths; raises BuildError if there is none."""
    with zipfile.ZipFile(wheel) as archive:
        paths = [PurePosixPath(name) for name in archive.namelist() if not name.endswith((".py", "/"))]
        found = [path for path in paths if _LICENCE_NAME.match(path.name) or "licenses" in path.parts]
        if not found:
            raise BuildError(f"{wheel.name} holds no licence text.")
        return {str(path): archive.read(str(path)) for path in found}


def check(path: Path, platform: str, wheels: list[Path]) -> None:
    """Compare a package with what it should contain; raises BuildError if anything differs."""
    expected = {f"wheels/{wheel.name}": hashlib.sha256(wheel.read_bytes()).hexdigest() for wheel in wheels}
    with zipfile.ZipFile(path) as archive:
        broken = archive.testzip()
        if broken is not None:
            raise BuildError(f"{path.name} is broken at {broken}.")
        names = set(archive.namelist())
        stated = tomllib.loads(archive.read(MANIFEST).decode())
        held = {name: hashlib.sha256(archive.read(name)).hexdigest() for name in names if name.startswith("wheels/")}
    project = tomllib.loads((REPOSITORY / MANIFEST).read_text(encoding="utf-8"))
    if stated != project | {"platforms": [platform], "wheels": [f"./{name}" for name in expected]}:
        raise BuildError(f"The manifest in {path.name} is not the project's with the platform and the wheels added.")
    if held != expected:
        wrong = sorted(held.items() ^ expected.items())[0][0]
        raise BuildError(f"{path.name} does not hold the pinned wheels: {wrong} is missing, added or changed.")
    if any(wheel.name.startswith("numpy-") for wheel in wheels):
        raise BuildError("Blender brings its own numpy, which a wheel would replace; take numpy out of the pins.")
    for start in ("__init__.py", "LICENSE", f"licences/{NOTICES.name}", *(_licence_folder(w.name) for w in wheels)):
        if not any(name == start or name.startswith(f"{start}/") for name in names):
            raise BuildError(f"{path.name} lacks {start}.")


def validate(path: Path) -> None:
    """Check the package with Blender's own validator and list of tags; raises BuildError with its message."""
    spec = importlib.util.find_spec("bpy")
    scripts = list(Path(spec.origin).parent.glob("*/scripts")) if spec and spec.origin else []
    if not scripts:
        raise BuildError("Blender's Python module, which has the validator, is not installed (pip install bpy).")
    validator = scripts[0] / "addons_core/bl_pkg/cli/blender_ext.py"
    tags = scripts[0] / "modules/_bpy_internal/extensions/tags.py"
    command = [sys.executable, str(validator), "validate", "--valid-tags", str(tags), str(path)]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode != 0 or "Success" not in run.stdout:
        raise BuildError(f"Blender's validator refuses {path.name}: {(run.stdout + run.stderr).strip()}")


def _licence_folder(wheel: str) -> str:
    package, version, python, _, _ = wheel.split("-")
    return f"licences/{package}-{version}-{python}"


def _add(archive: zipfile.ZipFile, name: str, content: bytes, method: int = zipfile.ZIP_DEFLATED) -> None:
    """Add a file with a fixed date, so that equal content makes equal packages."""
    entry = zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0))
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, content, method)


if __name__ == "__main__":
    sys.exit(main())
