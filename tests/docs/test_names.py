# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Modules and names that the documentation mentions exist."""

from __future__ import annotations

import importlib
import re
from functools import reduce
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
# `solver/module.py`: `Name`, `Name.name`
NAMED = re.compile(r"`solver/([\w/]+)\.py`: ((?:`[\w.]+`(?:, )?)+)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_modules_exist(page: Path) -> None:
    for module in re.findall(r"`solver/([\w/]+)\.py`", page.read_text(encoding="utf-8")):
        importlib.import_module(_dotted(module))


def test_every_formula_is_computed_where_it_says() -> None:
    found = NAMED.findall((DOCS / "science" / "method.md").read_text(encoding="utf-8"))
    assert len(found) > 20
    for module, names in found:
        for name in re.findall(r"`([\w.]+)`", names):
            reduce(getattr, name.split("."), importlib.import_module(_dotted(module)))


@pytest.mark.parametrize("page", [*PAGES, *sorted(DOCS.parent.glob("*.md"))], ids=lambda page: page.name)
def test_what_pages_link_to_exists(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), target


def _dotted(module: str) -> str:
    return f"qc3d_addon.solver.{module.replace('/', '.')}"
