# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A truncated .blend file is detected without opening it."""

from __future__ import annotations

import random
from pathlib import Path

import bpy
import pytest

from qc3d_addon.blender.native_files import is_whole


@pytest.fixture(params=[False, True], ids=["plain", "compressed"])
def saved(request: pytest.FixtureRequest, figure: bpy.types.Object, tmp_path: Path) -> Path:
    path = tmp_path / "whole.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=request.param)
    assert (path.read_bytes()[:7] == b"BLENDER") != request.param
    return path


def test_a_whole_file(saved: Path) -> None:
    assert is_whole(saved)


def test_the_demo_files(repository: Path) -> None:
    files = list((repository / "assets").glob("*.blend"))
    assert files
    for path in files:
        assert is_whole(path)


def test_files_that_end_too_early(saved: Path) -> None:
    """As where the disk gets full."""
    data, choose = saved.read_bytes(), random.Random(0)
    lengths = [0, 1, 7, 11, 12, 16, 17, 30, len(data) - 1, len(data) - 8, len(data) - 9, len(data) - 4096]
    for length in [*lengths, *choose.sample(range(len(data)), 200)]:
        saved.write_bytes(data[:length])
        assert not is_whole(saved), length


def test_files_with_too_much(saved: Path) -> None:
    data, choose = saved.read_bytes(), random.Random(1)
    for _ in range(50):
        saved.write_bytes(data + data[-choose.randrange(1, len(data)) :])
        assert not is_whole(saved)


@pytest.mark.parametrize("saved", [True], indirect=True, ids=["compressed"])
def test_a_compressed_file_that_misses_a_part(saved: Path) -> None:
    data, choose = saved.read_bytes(), random.Random(2)
    for _ in range(50):
        start = choose.randrange(5, len(data) - 100)
        saved.write_bytes(data[:start] + data[start + 50 :])
        assert not is_whole(saved), start


def test_what_is_no_blend_file(tmp_path: Path) -> None:
    for content in (b"", b"PNG", b"BLENDER", b"BLENDER-v405" + bytes(100), bytes.fromhex("28b52ffd") + bytes(100)):
        (tmp_path / "odd.blend").write_bytes(content)
        assert not is_whole(tmp_path / "odd.blend")
