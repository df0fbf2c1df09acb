# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshing child process: its input, and one error for every kind of failure, with stand-ins for the program."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.errors import MeshingError
from qc3d_addon.solver.meshing import tetwild, tetwild_loading
from qc3d_addon.solver.meshing.poisson_disk import RESOLUTIONS
from qc3d_addon.solver.support.child_python import interpreter

from ..meshes import icosphere

ARRAYS = {"points": np.zeros((4, 3))}


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A file that plays the child program, with ``folder`` set; temporary folders are made beside it."""
    script = tmp_path / "child.py"
    monkeypatch.setattr(tetwild_loading, "CHILD", script)
    monkeypatch.setattr(tetwild_loading, "_wrapper", lambda: tmp_path / "wrapper")
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return script


def play(script: Path, *lines: str) -> None:
    start = ["import os, sys, time", "sys.path.append(sys.argv[2])", "folder = sys.argv[3]"]
    script.write_text("\n".join([*start, *lines]), encoding="utf-8")


def ended(pid: int) -> bool:
    """Whether a process is gone or a zombie, waiting a moment for the system to notice."""
    for _ in range(100):
        try:
            state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
        except (FileNotFoundError, ProcessLookupError):
            return True
        if state == "Z":
            return True
        time.sleep(0.02)
    return False


def test_arrays_go_there_and_back(stand_in: Path) -> None:
    play(
        stand_in,
        "import numpy as np",
        "points = np.load(folder + '/points.npy')",
        "np.savez(folder + '/output.npz', points=points + 1, tets=np.arange(4, dtype=np.int32)[None])",
    )
    points, tets = tetwild.run_child({"points": np.arange(12.0).reshape(4, 3)}, 20.0)
    np.testing.assert_array_equal(points, np.arange(12.0).reshape(4, 3) + 1)
    np.testing.assert_array_equal(tets, [[0, 1, 2, 3]])
    assert tets.dtype == np.int64
    assert not list((stand_in.parent / "temporary").iterdir())


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("raise SystemExit(0)", "without a mesh"),
        ("os.abort()", "without a mesh"),
        ("raise ValueError('no such mesh')", "ValueError: no such mesh"),
        ("sys.exit('out of cheese')", "out of cheese"),
        ("sys.stderr.write('x' * 10**6); sys.exit(1)", "with an error: x{300}\\."),
        ("raise OSError(28, 'No space left on device')", "No space left on device"),
        ("open(folder + '/unfinished.npz', 'wb').write(b'half a resu')", "without a mesh"),
        ("open(folder + '/output.npz', 'wb').write(b'not an archive')", "cannot be read"),
    ],
)
def test_each_failure_is_one_error(stand_in: Path, line: str, message: str) -> None:
    play(stand_in, line)
    with pytest.raises(MeshingError, match=message):
        tetwild.run_child(ARRAYS, 20.0)
    assert not list((stand_in.parent / "temporary").iterdir())


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for the child's processes in /proc")
def test_the_time_limit_ends_the_child(stand_in: Path, tmp_path: Path) -> None:
    play(
        stand_in,
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))",
        "time.sleep(600)",
    )
    start = time.monotonic()
    with pytest.raises(MeshingError, match="time limit of 2 s"):
        tetwild.run_child(ARRAYS, 2.0)
    assert time.monotonic() - start < 15.0
    assert ended(int((tmp_path / "pid").read_text(encoding="utf-8")))
    assert not list((tmp_path / "temporary").iterdir())


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for the child's process in /proc")
def test_an_interrupt_ends_the_child(stand_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "pid"
    play(stand_in, f"open({str(own)!r}, 'w').write(f'{{os.getpid()}}.')", "time.sleep(600)")

    def interrupt() -> None:
        while not (own.exists() and own.read_text().endswith(".")):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Thread(target=interrupt, daemon=True).start()
    try:
        with pytest.raises(KeyboardInterrupt):
            tetwild.run_child(ARRAYS, 20.0)
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended(int(own.read_text()[:-1]))
    assert not list((tmp_path / "temporary").iterdir())


def test_a_missing_package_is_an_error_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tetwild_loading.importlib.util, "find_spec", lambda name: None)
    assert tetwild_loading.unavailable_reason() is not None
    with pytest.raises(MeshingError, match="pytetwild is not installed"):
        tetwild.run_child(ARRAYS, 20.0)


def test_an_application_is_not_taken_for_an_interpreter(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where Python is embedded, sys.executable can be the application; starting it would open a second window."""
    application = tmp_path / "blender"
    application.write_text("", encoding="utf-8")
    application.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(application))
    found = interpreter()
    assert found is not None
    assert "python" in found.name
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(sys, "base_prefix", str(tmp_path))
    assert interpreter() is None


def test_finding_the_engine_imports_nothing() -> None:
    lines = "import sys; from qc3d_addon.solver.meshing import tetwild_loading; tetwild_loading.unavailable_reason(); "
    check = lines + "sys.exit(any('tetwild' in name.lower() and 'qc3d' not in name for name in sys.modules))"
    root = Path(tetwild.__file__).resolve().parents[3]
    assert subprocess.run([sys.executable, "-c", check], cwd=root, env={**os.environ}).returncode == 0


def test_clustering_keeps_the_shape_and_drops_what_collapses() -> None:
    points, faces = icosphere(5)
    vertices, triangles = tetwild.cluster(points, faces, 0.05)
    assert len(triangles) < 0.2 * len(faces)
    assert np.abs(np.linalg.norm(vertices - 0.5, axis=1) - 0.3).max() < 0.01
    assert len(np.unique(triangles)) == len(vertices)
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(sides, axis=0, return_counts=True)[1] >= 2).all()  # still without a border


def test_clustering_leaves_a_coarse_mesh_alone() -> None:
    points, faces = icosphere(1)
    vertices, triangles = tetwild.cluster(points, faces, 1e-3)
    assert len(triangles) == len(faces)
    np.testing.assert_array_equal(np.unique(vertices, axis=0), np.unique(points, axis=0))


def test_clustering_of_degenerate_triangles() -> None:
    points = np.array([[0.2, 0.2, 0.2], [0.2, 0.2, 0.2], [0.8, 0.2, 0.2], [0.2, 0.8, 0.2]])
    vertices, triangles = tetwild.cluster(points, np.array([[0, 1, 2], [2, 2, 2], [0, 2, 3], [1, 3, 2]]), 0.01)
    assert len(vertices) == 3
    assert np.array_equal(triangles, [[0, 1, 2]]) or np.array_equal(np.sort(triangles), [[0, 1, 2]])
    for nothing in (np.empty((0, 3), dtype=np.int64), np.array([[0, 1, 2]])):
        vertices, triangles = tetwild.cluster(points, nothing, 0.01)
        assert vertices.shape == (0, 3)
        assert triangles.shape == (0, 3)


@pytest.mark.skipif(
    tetwild_loading.unavailable_reason() is not None, reason=f"tetwild: {tetwild_loading.unavailable_reason()}"
)
def test_the_child_program_reports_bad_arguments_in_one_line(tmp_path: Path) -> None:
    command = [sys.executable, "-I", str(tetwild_loading.CHILD), str(tmp_path / "none.so"), "", str(tmp_path), "10"]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 1
    assert len(result.stderr.strip().splitlines()) == 1


@pytest.mark.skipif(
    tetwild_loading.unavailable_reason() is not None, reason=f"tetwild: {tetwild_loading.unavailable_reason()}"
)
def test_the_cube_is_exact(tmp_path: Path) -> None:
    mesh = tetwild.tetwild_mesh(*icosphere(2, 0.15), RESOLUTIONS["normal"], 0, 60.0)
    assert mesh.points.min() == 0.0
    assert mesh.points.max() == 1.0
    assert mesh.on_cube_face[mesh.boundary_faces].all(axis=1).any(axis=1).all()
