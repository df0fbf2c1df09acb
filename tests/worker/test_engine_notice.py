# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sentence that names the engine in use, with stand-ins for the compiled module."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from qc3d_addon.solver.meshing import tetwild_loading
from qc3d_addon.worker import engines


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    engines.forget()
    yield
    engines.forget()


def settled() -> str | None:
    """The notice once the child process has ended."""
    engines.engine_notice()
    for _ in range(400):
        if engines._probe is None:
            break
        time.sleep(0.02)
        engines.engine_notice()
    assert engines._probe is None
    return engines.engine_notice()


def test_nothing_is_said_where_ftetwild_loads() -> None:
    if tetwild_loading.unavailable_reason() is not None:
        pytest.skip(f"fTetWild cannot run here: {tetwild_loading.unavailable_reason()}")
    assert settled() is None


def test_a_module_that_does_not_load_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    broken = tmp_path / "PyfTetWildWrapper.so"
    broken.write_bytes(b"for another system")
    monkeypatch.setattr(tetwild_loading, "_wrapper", lambda: broken)
    reason = "its compiled module does not load on this system"
    assert settled() == f"The engine delaunay is used here, because tetwild cannot run: {reason}."


def test_a_missing_module_is_said_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tetwild_loading, "_wrapper", lambda: None)
    notice = engines.engine_notice()
    assert notice is not None
    assert "pytetwild is not installed for this Python" in notice


def test_it_asks_once_and_answers_without_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr(tetwild_loading, "_wrapper", lambda: asked.append(1))
    engines.engine_notice()
    asked.clear()
    start = time.perf_counter()
    for _ in range(1000):
        engines.engine_notice()
    assert time.perf_counter() - start < 0.1
    assert asked == []


def test_forgetting_ends_the_child_process(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    sleeper = tmp_path / "child.py"
    sleeper.write_text("import time\ntime.sleep(60)\n", encoding="utf-8")
    monkeypatch.setattr(tetwild_loading, "CHILD", sleeper)
    monkeypatch.setattr(tetwild_loading, "_wrapper", lambda: tmp_path)
    assert engines.engine_notice() is None
    child = engines._probe
    assert child is not None
    engines.forget()
    assert child.returncode is not None


def test_asking_loads_no_library(repository: Path) -> None:
    script = (
        f"import sys; sys.path.insert(0, {str(repository)!r})\n"
        "from qc3d_addon.worker import engines\n"
        "engines.engine_notice(); engines.forget()\n"
        "print([name for name in ('numpy', 'scipy', 'pytetwild', 'pyvista') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
