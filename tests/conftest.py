# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by all tests: where the repository and the optional real meshes are, and a small pair of keys."""

from __future__ import annotations

import atexit
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

REPOSITORY = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("QC3D_DATA") or REPOSITORY.parent / "shared" / "data").resolve()

# A busy machine is no failure; and continuous integration tries the same examples every time.
settings.register_profile("qc3d", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("qc3d")


def pytest_sessionfinish(exitstatus: int) -> None:
    _status.append(int(exitstatus))


def _end() -> None:
    """End here: Blender's module tears down its libraries after Python's end, and once waited for itself there."""
    if _status and "bpy" in sys.modules:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_status[-1])


_status: list[int] = []
atexit.register(_end)  # what others register later is done before


def pytest_report_header() -> str:
    if DATA.is_dir():
        return f"real meshes: {DATA}"
    return f"real meshes: none, tests on them are skipped ({DATA} does not exist; QC3D_DATA names another folder)"


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the checkout."""
    return REPOSITORY


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """The folder of real meshes; tests that ask for it are skipped where there is none."""
    if not DATA.is_dir():
        pytest.skip(f"the folder of real meshes {DATA} does not exist (set QC3D_DATA)")
    return DATA


@pytest.fixture(scope="session")
def bar() -> dict[str, np.ndarray]:
    """A bar of 1 x 1 x 4 as the arrays of a pair file: straight, and its upper half bent smoothly by 40 degrees."""
    rest, faces = _box((3, 3, 12), (1.0, 1.0, 4.0))
    bend = np.radians(40.0) * np.clip((rest[:, 2] - 2.0) / 2.0, 0.0, 1.0) ** 2
    rise = np.maximum(rest[:, 2] - 2.0, 0.0)
    bent = rest.copy()
    bent[:, 0] += np.sin(bend) * rise
    bent[:, 2] += (np.cos(bend) - 1.0) * rise
    return {"faces": faces, "shape_names": np.array(["straight", "bent"]), "V0": rest, "V1": bent}


@pytest.fixture
def bar_file(bar: dict[str, np.ndarray], tmp_path: Path) -> Path:
    """The bar in a file, as the command line reads it."""
    path = tmp_path / "bar.npz"
    np.savez(path, **bar)
    return path


@pytest.fixture(scope="session")
def bar_scene(bar: dict[str, np.ndarray], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A .blend with the bar as the object "Bar", shape keys Basis and Bent, and "Plain", which has no shape keys."""
    import bpy  # only here: tests of the solver run without Blender

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("Bar")
    mesh.from_pydata(bar["V0"].tolist(), [], bar["faces"].tolist())
    obj = bpy.data.objects.new("Bar", mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.collection.objects.link(bpy.data.objects.new("Plain", mesh.copy()))
    obj.shape_key_add(name="Basis", from_mix=False)
    bent = obj.shape_key_add(name="Bent", from_mix=False)
    bent.value = 0.0
    bent.points.foreach_set("co", bar["V1"].astype(np.float32).ravel())
    path = tmp_path_factory.mktemp("scene") / "bar.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def _box(cells: tuple[int, int, int], size: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """The surface of a box, a grid of ``cells`` along its edges: vertices and triangles whose normals point out."""
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        across, along = np.meshgrid(np.arange(cells[u]), np.arange(cells[v]), indexing="ij")
        for end in (0, cells[axis]):
            quad = np.zeros((across.size, 4, 3), dtype=np.int64)
            quad[:, :, axis] = end
            quad[:, :, u] = across.ravel()[:, None] + np.array([0, 1, 1, 0])
            quad[:, :, v] = along.ravel()[:, None] + np.array([0, 0, 1, 1])
            quads.append(quad if end else quad[:, ::-1])
    corners = np.concatenate(quads)
    grid, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    loops = index.reshape(-1, 4)
    return grid / np.array(cells) * np.array(size), np.concatenate([loops[:, [0, 1, 2]], loops[:, [0, 2, 3]]])
