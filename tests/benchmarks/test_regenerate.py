# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every picture and every marked table of the documentation is made by exactly one entry of the registry."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import regenerate
from benchmarks.registry import ENTRIES, Entry

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("docs/**/*.md"), ROOT / "README.md"]


def test_every_picture_belongs_to_one_entry() -> None:
    known = sorted(name for entry in ENTRIES for name in entry.pictures)
    endings = {".png", ".webp", ".gif", ".svg", ".jpg"}
    there = [path.relative_to(ROOT).as_posix() for path in ROOT.glob("docs/**/*") if path.suffix in endings]
    assert known == sorted(there)


def test_every_marked_table_belongs_to_one_entry() -> None:
    known = sorted(table for entry in ENTRIES for table in entry.tables)
    there = [
        (page.relative_to(ROOT).as_posix(), writer)
        for page in PAGES
        for writer in re.findall(r"<!-- begin: written by (.*?) -->", page.read_text(encoding="utf-8"))
    ]
    assert known == sorted(there)
    assert len(known) > 4


def test_names_commands_and_pages_exist() -> None:
    names = [entry.name for entry in ENTRIES]
    assert len(set(names)) == len(names)
    for entry in ENTRIES:
        for page in entry.printed:
            assert (ROOT / page).is_file()
        for words in entry.commands:
            scripts = [word for word in words if word.endswith(".py")]
            modules = [f"{words[k + 1].replace('.', '/')}" for k, word in enumerate(words) if word == "-m"]
            found = [ROOT / script for script in scripts] + [
                path for module in modules for path in (ROOT / f"{module}.py", ROOT / module / "__main__.py")
            ]
            assert any(path.is_file() for path in found), words


def test_what_changed_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(regenerate, "ROOT", tmp_path)
    monkeypatch.setattr(regenerate, "WORK", tmp_path / "work")
    (tmp_path / "page.md").write_text("| a | b |\n|---|---|\n| 1 | 2 |\n", encoding="utf-8")
    (tmp_path / "same.png").write_bytes(b"picture")
    program = (
        "import pathlib, sys; work = pathlib.Path(sys.argv[1]); (work / 'a.png').write_bytes(b'picture');"
        "(work / 'b.png').write_bytes(b'new'); print('| a | b |'); print('| --- | --- |'); print('| 1 | 3 |')"
    )
    pictures = {"same.png": "a.png", "other.png": "b.png"}
    entry = Entry("try", (("{python}", "-c", program, "{work}"),), "seconds", pictures, printed=("page.md",))
    assert regenerate.make(entry) == ["as it was: same.png", "changed: other.png", "1 printed rows are not on page.md"]
    assert (tmp_path / "other.png").read_bytes() == b"new"


def test_what_cannot_be_made_here_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(regenerate, "DATA", tmp_path / "nothing")
    monkeypatch.delenv("QC3D_BLENDER_ROOT", raising=False)
    plain = Entry("x", (), "seconds")
    entries = [plain, replace(plain, needs="shapes"), replace(plain, needs="window")]
    said = [regenerate.reason_to_leave_out(entry) for entry in entries]
    assert said[0] is None
    assert "QC3D_DATA" in str(said[1])
    assert "QC3D_BLENDER_ROOT" in str(said[2])
