# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons that write files, attacked in the same ways as the commands in tests/attacks/test_outputs.py."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

from qc3d_addon.solver.settings import FitOptions

from ..attacks.commands import listing
from ..attacks.conftest import small_disk, temporary  # noqa: F401 - fixtures
from ..attacks.test_outputs import NO_FILES

pytestmark = pytest.mark.skipif(os.name == "nt", reason="makes pipes and links as Linux and macOS do")

Write = Callable[..., Any]


@pytest.fixture(params=["save_map", "export_alembic"])
def button(request: pytest.FixtureRequest) -> tuple[Write, str]:
    """What writes, and the ending of its file."""
    operator = getattr(bpy.ops.qc3d, request.param)
    return operator, {"save_map": ".qc3dmap", "export_alembic": ".abc"}[request.param]


@pytest.fixture(autouse=True)
def baked(figure: bpy.types.Object, quick_map: list[FitOptions]) -> bpy.types.Object:
    """The figure with in-betweens."""
    bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=2, mode='linear')
    return figure


@pytest.mark.parametrize("make", NO_FILES)
def test_what_is_no_file_is_refused(
    button: tuple[Write, str], make: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write, ending = button
    path = tmp_path / f"odd{ending}"
    make(path)
    before = listing(tmp_path)
    with pytest.raises(RuntimeError, match="is a device, a pipe or a socket, which is never written to"):
        write(filepath=str(path))
    assert listing(tmp_path) == before


def test_links_are_followed_and_modes_kept(button: tuple[Write, str], tmp_path: Path) -> None:
    write, ending = button
    real, link = tmp_path / f"real{ending}", tmp_path / f"link{ending}"
    real.write_text("earlier")
    real.chmod(0o640)
    link.symlink_to(real)
    assert write(filepath=str(link)) == {"FINISHED"}
    assert link.is_symlink()
    assert real.stat().st_size > 1000
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    assert sorted(path.name for path in tmp_path.iterdir()) == [link.name, real.name]


@pytest.mark.parametrize("length", [240, 255])
def test_long_names(button: tuple[Write, str], length: int, tmp_path: Path) -> None:
    write, ending = button
    path = tmp_path / f"{'a' * (length - len(ending))}{ending}"
    assert write(filepath=str(path)) == {"FINISHED"}
    assert path.stat().st_size > 1000
    before = listing(tmp_path)
    with pytest.raises(RuntimeError, match="cannot be written: File name too long; choose a shorter name"):
        write(filepath=str(tmp_path / f"{'a' * (256 - len(ending))}{ending}"))
    assert listing(tmp_path) == before


def test_full_disks(
    button: tuple[Write, str],
    small_disk: Path,  # noqa: F811
    state: Callable[[], dict[str, Any]],
) -> None:
    """Blender's own exporter of Alembic files would end Blender, with all that was not saved."""
    write, ending = button
    path = small_disk / f"new{ending}"
    path.write_text("earlier")
    for room in (0, 4096, 20_480):
        (small_disk / "ballast").unlink(missing_ok=True)
        (small_disk / "ballast").write_bytes(bytes(os.statvfs(small_disk).f_bavail * 4096 - room))
        before, scene = listing(small_disk), state()
        if room == 20_480 and ending == ".qc3dmap":
            break  # it has room there
        with pytest.raises(RuntimeError, match="cannot be written: No space left on device; make room on that disk"):
            write(filepath=str(path))
        assert listing(small_disk) == before
        assert state() == scene


@pytest.mark.parametrize("frames", [2, 50])
@pytest.mark.parametrize("levels", [None, 2])
@pytest.mark.parametrize("after", [False, True])
def test_the_room_that_an_alembic_file_needs_is_known(
    baked: bpy.types.Object,
    tmp_path: Path,
    frames: int,
    levels: int | None,
    after: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It has to be: more would be refused without a reason, and less would end Blender."""
    from qc3d_addon.blender.chains import alembic

    asked = []
    monkeypatch.setattr(alembic, "require_room", lambda path, size: asked.append(size))
    if levels is not None:
        surface = baked.modifiers.new("Subdivision", 'SUBSURF')
        surface.levels, surface.render_levels = 0, levels
    if after:
        baked.modifiers.new("Solidify", 'SOLIDIFY').show_viewport = False
    path = tmp_path / "new.abc"
    assert bpy.ops.qc3d.export_alembic(filepath=str(path), frames=frames) == {"FINISHED"}
    size = path.stat().st_size
    assert size < asked[0] < 3 * size + 2**20 + 2**18
