# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays go down, frames come up: the solver and its worker know nothing of Blender, and nothing of the layer above."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

BLENDER_MODULES = {"bpy", "bpy_extras", "bmesh", "mathutils", "gpu", "blf", "addon_utils", "bl_ui", "bl_operators"}
HEAVY_MODULES = {"pyvista", "torch"}
MAY_IMPORT = {"solver": {"solver"}, "worker": {"solver", "worker"}}


def forbidden_imports(source: str, package: str, depth: int = 1) -> list[str]:
    """What a module of ``package`` imports and may not; ``depth`` is 1 for a module directly in the package."""
    found = []
    for node in ast.walk(ast.parse(source)):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [node.module or ""]
        elif isinstance(node, ast.ImportFrom) and node.level > depth:
            inside = [node.module] if node.module else [alias.name for alias in node.names]
            found += ["." * node.level + name for name in inside if name.split(".")[0] not in MAY_IMPORT[package]]
        banned = BLENDER_MODULES | HEAVY_MODULES | {"qc3d_addon"}
        found += [name for name in names if name.split(".")[0] in banned]
    return found


@pytest.mark.parametrize(
    ("source", "package"),
    [
        ("import bpy", "solver"),
        ("def late():\n    from mathutils import Vector", "solver"),
        ("from ..blender import bake", "solver"),
        ("from .. import worker", "solver"),
        ("from ..blender.bake import run", "worker"),
        ("import qc3d_addon.blender", "solver"),
        ("import torch", "worker"),
    ],
)
def test_a_forbidden_import_is_found(source: str, package: str) -> None:
    assert len(forbidden_imports(source, package)) == 1


@pytest.mark.parametrize("source", ["import numpy", "from .errors import InputError", "from ..solver import pipeline"])
def test_an_allowed_import_is_not(source: str) -> None:
    assert forbidden_imports(source, "worker") == []


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_lower_layers_import_nothing_from_above(repository: Path, package: str) -> None:
    folder = repository / "qc3d_addon" / package
    found = {
        str(path.relative_to(repository)): names
        for path in folder.rglob("*.py")
        if (names := forbidden_imports(path.read_text(), package, len(path.relative_to(folder).parts)))
    }
    assert found == {}


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
