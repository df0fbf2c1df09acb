# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The drawing of the packages shows what the code imports."""

from __future__ import annotations

from pathlib import Path

import draw_packages


def test_every_room_and_the_imports_between_them(repository: Path, tmp_path: Path) -> None:
    sizes, arrows = draw_packages.imports(repository)
    assert sizes["frames"] > 10
    assert arrows["frames", "fit"] > 0
    assert arrows["fit", "frames"] == 0
    draw_packages.draw(tmp_path / "packages.png")
    assert (tmp_path / "packages.png").stat().st_size > 10_000
