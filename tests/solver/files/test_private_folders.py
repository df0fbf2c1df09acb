# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Private folders are removed with their owner. What the sweep must not remove is in tests/attacks/test_folders.py."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from qc3d_addon.solver.files.private_folders import PrivateFolder


@pytest.fixture(autouse=True)
def temporary(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


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


def test_a_file_beside_it_goes_with_it(temporary: Path) -> None:
    folder = PrivateFolder()
    path = folder.beside(".blend")
    assert path.parent == folder.path.parent == temporary
    for name in (path, path.with_name(f"{path.name}@")):
        name.write_text("half")
    folder.close()
    assert list(temporary.iterdir()) == []
