# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The layering of the code: packages import from lower floors only, modules do not import each other in a circle, and
nothing below the Blender layer imports Blender's modules.
"""

from __future__ import annotations

import ast
import itertools
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

# From the ground up; a package may import from those on lower floors, and what is in it from itself.
SOLVER_FLOORS = (
    ("arrays", "errors"),
    ("settings", "files"),
    ("numerics", "support"),
    ("triangles", "tets"),
    ("keys", "meshing"),
    ("surface", "collision", "maps"),
    ("compression",),
    ("fit",),
    ("frames",),
    ("combinations",),
    ("steps",),
    ("api",),
)
ADDON_FLOORS = (("solver",), ("worker",), ("blender",), ("cli",), ("start",), ("__main__",))
BLENDER_FLOORS = (
    ("kinds",),
    ("compat", "native_files", "preferences", "translations"),
    ("store",),
    ("keys",),
    ("heat_map",),
    ("bake",),
    ("choices",),
    ("chains", "live_scrub", "properties"),
    ("combinations", "exports"),
    ("operators",),
    ("ui",),
    ("cli",),
    ("registration",),
)
HOUSES = {"qc3d_addon": ADDON_FLOORS, "qc3d_addon.solver": SOLVER_FLOORS, "qc3d_addon.blender": BLENDER_FLOORS}
# Upward on purpose, and only when it is called: Blender runs the command as "blender --command qc3d".
LATE = {("blender", "cli")}
BELOW_BLENDER = ("qc3d_addon.solver", "qc3d_addon.worker")
BLENDER_MODULES = {"bpy", "bpy_extras", "bmesh", "mathutils", "gpu", "blf", "addon_utils", "bl_ui", "bl_operators"}
HEAVY_MODULES = {"pyvista", "torch", "matplotlib", "qc3d_paper"}
MOST_MODULES = 8
PACKAGE = "qc3d_addon"


def imports_of(source: str, module: str, is_package: bool = False) -> Iterator[str]:
    """Absolute names of everything that a module imports, at its top or later."""
    parts = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = parts[: len(parts) - node.level + 1] if node.level else []
            target = [*base, *(node.module.split(".") if node.module else [])]
            yield from (".".join([*target, alias.name]) for alias in node.names)


def floor_of(floors: tuple[tuple[str, ...], ...], room: str) -> int:
    """The number of the floor that a room is on; ValueError where it is on none."""
    for number, rooms in enumerate(floors):
        if room in rooms:
            return number
    raise ValueError(f"{room} is on no floor; add it to the list")


def upward_imports(source: str, module: str, is_package: bool = False) -> list[str]:
    """What a module imports from a room on its own or a higher floor, and what no layer below Blender's may import."""
    found = []
    for name in imports_of(source, module, is_package):
        if module.startswith(BELOW_BLENDER) and name.split(".")[0] in BLENDER_MODULES | HEAVY_MODULES:
            found.append(name)
        for house, floors in HOUSES.items():
            own, other = _room(module, house), _room(name, house)
            if own is None or other is None or own == other or (own, other) in LATE:
                continue
            if floor_of(floors, own) <= floor_of(floors, other):
                found.append(name)
    return found


def _room(name: str, house: str) -> str | None:
    """The package or module directly in ``house`` that a dotted name lies in."""
    inside = name.removeprefix(f"{house}.")
    return None if inside == name else inside.split(".")[0]


def modules(repository: Path) -> Iterator[tuple[str, bool, str]]:
    """Name, whether it is a package's own file, and source of every module of the add-on."""
    for path in sorted((repository / PACKAGE).rglob("*.py")):
        is_package = path.name == "__init__.py"
        parts = path.relative_to(repository).with_suffix("").parts
        yield ".".join(parts[:-1] if is_package else parts), is_package, path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("import bpy", "qc3d_addon.solver.maps.mapping"),
        ("def late():\n    from mathutils import Vector", "qc3d_addon.solver.maps.mapping"),
        ("from ...blender import bake", "qc3d_addon.solver.maps.mapping"),
        ("from ...worker import client", "qc3d_addon.solver.frames.task"),
        ("from ..fit import storage", "qc3d_addon.solver.maps.mapping"),
        ("from ..maps.mapping import Mapping", "qc3d_addon.solver.surface.path"),
        ("from ..blender.bake import run", "qc3d_addon.worker.client"),
        ("import qc3d_addon.blender", "qc3d_addon.solver.errors"),
        ("from ..ui import panels", "qc3d_addon.blender.bake.plan"),
        ("import torch", "qc3d_addon.worker.client"),
    ],
)
def test_an_upward_import_is_found(source: str, module: str) -> None:
    assert len(upward_imports(source, module)) == 1


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("import numpy", "qc3d_addon.worker.client"),
        ("from ..solver.errors import InputError", "qc3d_addon.worker.client"),
        ("from .representation import conductivity", "qc3d_addon.solver.maps.mapping"),
        ("from ..store import names", "qc3d_addon.blender.keys.slider"),
    ],
)
def test_a_downward_import_is_not(source: str, module: str) -> None:
    assert upward_imports(source, module) == []


def test_no_module_imports_upward(repository: Path) -> None:
    found = {
        name: upward
        for name, is_package, source in modules(repository)
        if (upward := upward_imports(source, name, is_package))
    }
    assert found == {}


def test_no_circle_of_modules(repository: Path) -> None:
    every = {name: (source, is_package) for name, is_package, source in modules(repository)}
    needs = {}
    for name, (source, is_package) in every.items():
        targets = set(imports_of(source, name, is_package))
        # What is imported from a module is the module's; what is a module itself counts as one.
        needs[name] = {
            known
            for target in targets
            for known in (target, target.rpartition(".")[0])
            if known in every and known not in (name, PACKAGE)
        }
    standing = dict(needs)
    while True:
        leaves = [name for name, others in standing.items() if not others & standing.keys()]
        if not leaves:
            break
        for name in leaves:
            del standing[name]
    assert set(standing) == set()


def test_few_modules_stand_directly_in_the_solver(repository: Path) -> None:
    direct = [path.name for path in (repository / PACKAGE / "solver").glob("*.py")]
    assert len(direct) <= MOST_MODULES, direct


def test_the_tests_of_the_solver_do_without_blender(repository: Path) -> None:
    code = """
import sys, pytest
for name in ("bpy", "bmesh", "mathutils", "gpu"):
    sys.modules[name] = None  # makes importing it an error
sys.exit(pytest.main(["--collect-only", "-q", "tests/solver"]))
"""
    run = subprocess.run([sys.executable, "-c", code], cwd=repository, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stdout[-2000:]


def test_everything_below_the_blender_layer_imports_without_blender(repository: Path) -> None:
    code = """
import importlib, pkgutil, sys
for name in ("bpy", "bmesh", "mathutils", "gpu"):
    sys.modules[name] = None  # makes importing it an error
import qc3d_addon
count = 0
for module in pkgutil.walk_packages(qc3d_addon.__path__, "qc3d_addon."):
    if module.name.startswith(("qc3d_addon.blender", "qc3d_addon.__main__")):
        continue
    importlib.import_module(module.name)
    count += 1
print(count)
"""
    run = subprocess.run([sys.executable, "-c", code], cwd=repository, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    assert int(run.stdout) > 5


def test_mypy_leaves_no_module_of_the_add_on_out(repository: Path) -> None:
    settings = tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]
    assert settings["strict"]
    assert PACKAGE in settings["files"]
    assert "exclude" not in settings
    for override in settings["overrides"]:
        assert not override.keys() & {"follow_imports", "ignore_errors"}, override
        ignored = override.get("ignore_missing_imports", False)
        assert not (ignored and {name.split(".")[0] for name in override["module"]} & {PACKAGE, *BLENDER_MODULES})


def test_nothing_is_imported_from_the_stubs_at_run_time(repository: Path) -> None:
    """Blender has no such module."""
    found = []
    for name, _, source in modules(repository):
        tree = ast.parse(source)
        unseen = {
            inner
            for node in ast.walk(tree)
            if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
            for inner in itertools.chain.from_iterable(ast.walk(statement) for statement in node.body)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and "stub" in (node.module or "") and node not in unseen:
                found.append(name)
    assert found == []


def test_every_property_of_blender_has_its_type_said_beside_it(repository: Path) -> None:
    """Blender reads the properties of a class, mypy their types: the same names, of kinds that go together."""
    kinds = {"StringProperty": "str", "IntProperty": "int", "BoolProperty": "bool", "FloatProperty": "float"}
    count = 0
    for name, _, source in modules(repository):
        for kind in (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ClassDef)):
            for choice in kind.body:
                if isinstance(choice, ast.If) and choice.orelse:
                    types, properties = _annotations(choice.body), _annotations(choice.orelse)
                    assert list(types) == list(properties), f"{name}.{kind.name}"
                    for key, value in properties.items():
                        expected = kinds.get(value.split("(")[0])
                        assert expected in (None, types[key]), f"{name}.{kind.name}.{key}"
                    count += len(properties)
    assert count > 20


def _annotations(statements: list[ast.stmt]) -> dict[str, str]:
    return {
        ast.unparse(statement.target): ast.unparse(statement.annotation)
        for statement in statements
        if isinstance(statement, ast.AnnAssign)
    }
