# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hooks of mkdocs: the pages that lie beside docs/ become pages of the site, and links between both lead there."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[1]
PAGES = ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
FOLDER = "project"
_LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)")


def on_files(files: Any, config: Any) -> Any:  # noqa: ANN401 - mkdocs has no types
    """Add the pages from the repository's top folder."""
    from mkdocs.structure.files import File

    for name in PAGES:
        content = (REPOSITORY / name).read_text(encoding="utf-8")
        files.append(File.generated(config, f"{FOLDER}/{name}", content=content))
    return files


def on_page_markdown(markdown: str, page: Any, **_: object) -> str:  # noqa: ANN401
    """Turn the links of a page from places in the repository to places in the site."""
    return site_links(markdown, page.file.src_uri)


def site_links(markdown: str, page: str) -> str:
    """The text of a page, given by its place in the site, with its links as they are in the site.

    >>> site_links("[changes](../CHANGELOG.md), [panel](guide/panel.md)", "index.md")
    '[changes](project/CHANGELOG.md), [panel](guide/panel.md)'
    >>> site_links("[panel](docs/guide/panel.md#bake)", "project/CHANGELOG.md")
    '[panel](../guide/panel.md#bake)'
    """
    inside, name = posixpath.split(page)
    folder = "" if inside == FOLDER and name in PAGES else posixpath.join("docs", inside)

    def turned(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(folder, match[1]))
        if target in PAGES:
            target = f"docs/{FOLDER}/{target}"
        return f"]({posixpath.relpath(target, posixpath.join('docs', inside))}"

    return _LINK.sub(turned, markdown)
