# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The site is built from the documentation, and no link in it leads nowhere."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import site_pages


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(repository: Path, tmp_path: Path) -> None:
    pytest.importorskip("material", reason="the extra docs is not installed: pip install 'qc3d[docs]'")
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1"}  # about a later version of mkdocs itself
    run = subprocess.run(build, cwd=repository, env=quiet, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "WARNING" not in run.stderr
    for page in ("index.html", "guide/first_bake/index.html", "project/CONTRIBUTING/index.html"):
        assert "QC3D" in (tmp_path / "site" / page).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("page", "link", "in_the_site"),
    [
        ("index.md", "../SECURITY.md", "project/SECURITY.md"),
        ("guide/limits.md", "../../SECURITY.md#files", "../project/SECURITY.md#files"),
        ("guide/panel.md", "../images/a.png", "../images/a.png"),
        ("project/CONTRIBUTING.md", "docs/develop/architecture.md", "../develop/architecture.md"),
        ("project/CONTRIBUTING.md", "CHANGELOG.md", "CHANGELOG.md"),
        ("index.md", "https://example.org/a", "https://example.org/a"),
    ],
)
def test_links_lead_to_the_places_in_the_site(page: str, link: str, in_the_site: str) -> None:
    assert site_pages.site_links(f"[text]({link})", page) == f"[text]({in_the_site})"
