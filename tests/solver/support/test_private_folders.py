# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Temporary folders go with what made them; those of others stay."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from qc3d_addon.solver.support.private_folders import PrivateFolder, remove_abandoned


@pytest.fixture(autouse=True)
def temporary(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def make_old(folder: Path) -> None:
    os.utime(folder, (time.time() - 1e5,) * 2)


def test_the_folder_goes_at_the_end(temporary: Path) -> None:
    folder = PrivateFolder()
    (folder.path / "inside").mkdir()
    (folder.path / "inside" / "file").write_text("text")
    assert folder.path.stat().st_mode & 0o077 == 0
    folder.close()
    folder.close()
    assert list(temporary.iterdir()) == []


def test_the_folder_goes_when_the_block_fails(temporary: Path) -> None:
    with pytest.raises(RuntimeError), PrivateFolder():
        raise RuntimeError
    assert list(temporary.iterdir()) == []


def test_a_folder_in_use_stays_however_old() -> None:
    with PrivateFolder() as folder:
        make_old(folder)
        with PrivateFolder():
            assert folder.is_dir()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kills a process as Linux and macOS do")
def test_the_folder_of_a_killed_process_goes_with_the_next_one(temporary: Path, repository: Path) -> None:
    program = (
        "import os, signal\n"
        "from qc3d_addon.solver.support.private_folders import PrivateFolder\n"
        "(PrivateFolder().path / 'data').write_text('large')\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", program], cwd=repository, env={**os.environ, "TMPDIR": str(temporary)})
    (left,) = temporary.iterdir()
    remove_abandoned()
    assert left.exists()  # so young that it might be in the making
    make_old(left)
    with PrivateFolder() as folder:
        assert list(temporary.iterdir()) == [folder]


def test_nothing_else_is_touched(temporary: Path) -> None:
    elsewhere = temporary / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "in_use").write_text("")
    (temporary / "qc3d-link").symlink_to(elsewhere)
    (temporary / "qc3d-file").write_text("mine")
    (temporary / "qc3d-project").mkdir()
    (temporary / "qc3d-project" / "drawing").write_text("mine too")
    for path in (elsewhere, temporary / "qc3d-project"):
        make_old(path)
    remove_abandoned()
    assert {path.name for path in temporary.iterdir()} == {"elsewhere", "qc3d-link", "qc3d-file", "qc3d-project"}
    assert (elsewhere / "in_use").exists()
