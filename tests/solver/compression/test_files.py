# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The contents of compressed map files, and what makes them invalid."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.compression import files as compressed_files
from qc3d_addon.solver.compression.compressed import Compressed
from qc3d_addon.solver.compression.files import Content, Source, from_bytes, read_bytes, to_bytes
from qc3d_addon.solver.errors import InputError

from ..meshes import jittered_grid

MESH = jittered_grid(4, seed=0)
SOURCE = Source("maps", MESH.points, MESH.tets)


def content(maps: int = 2, modes: int = 7, remainder: bool = True, held: int = 0) -> Content:
    random = np.random.default_rng(0)
    numbers = random.integers(-9, 10, size=(maps, modes, 6))
    rest = random.integers(-2, 3, size=(maps, len(MESH.points), 3)) if remainder else None
    images = random.normal(size=(maps, held, 3))
    compressed = Compressed("fitted", "sliding", 0.01, numbers, images, 0.25, 0.002 if remainder else 0.0, rest)
    return Content(60, compressed, (1.0, 2.0, 3.0, 0.5))


@pytest.mark.parametrize("held", [0, 5])
@pytest.mark.parametrize("remainder", [False, True])
@pytest.mark.parametrize("modes", [0, 7])
@pytest.mark.parametrize("maps", [1, 2, 4])
def test_there_and_back(maps: int, modes: int, remainder: bool, held: int, tmp_path: Path) -> None:
    written = content(maps, modes, remainder, held)
    (tmp_path / "maps.qc3d").write_bytes(to_bytes(SOURCE, written))
    found = from_bytes(read_bytes(tmp_path / "maps.qc3d"), SOURCE)
    assert (found.modes, found.placement) == (60, (1.0, 2.0, 3.0, 0.5))
    for name in ("scheme", "boundary", "step", "check", "remainder_step"):
        assert getattr(found.compressed, name) == getattr(written.compressed, name)
    np.testing.assert_array_equal(found.compressed.numbers, written.compressed.numbers)
    np.testing.assert_array_equal(found.compressed.held, written.compressed.held)
    if remainder:
        np.testing.assert_array_equal(found.compressed.remainder, written.compressed.remainder)
    else:
        assert found.compressed.remainder is None


def test_what_version_1_wrote_is_read() -> None:
    """By a range coder, which wrote this file from the same contents."""
    data = (Path(__file__).parent / "files" / "version1.qc3d").read_bytes()
    found, expected = from_bytes(data, SOURCE), content(maps=2, modes=7, held=5)
    assert data[8] == 1
    assert found.placement == expected.placement
    np.testing.assert_array_equal(found.compressed.numbers, expected.compressed.numbers)
    np.testing.assert_array_equal(found.compressed.remainder, expected.compressed.remainder)
    np.testing.assert_array_equal(found.compressed.held, expected.compressed.held)


def test_a_boundary_in_steps() -> None:
    written = content(maps=2, modes=1, remainder=False)
    before = MESH.points[SOURCE.boundary]
    held = before + 0.01 * np.random.default_rng(1).integers(-5, 6, size=(2, *before.shape))
    compressed = replace(written.compressed, boundary="fixed", held=held, held_step=0.01)
    data = to_bytes(SOURCE, replace(written, compressed=compressed))
    assert len(data) < 24 * before.size / 10
    np.testing.assert_allclose(from_bytes(data, SOURCE).compressed.held, held, atol=1e-15)


def test_every_truncation_is_refused() -> None:
    data = to_bytes(SOURCE, content())
    for length in range(len(data)):
        with pytest.raises(InputError):
            from_bytes(data[:length], SOURCE)


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 255))
def test_every_changed_byte_is_refused(place: int, change: int) -> None:
    data = bytearray(to_bytes(SOURCE, content(maps=1, remainder=False)))
    data[place % len(data)] ^= change
    with pytest.raises(InputError):
        from_bytes(bytes(data), SOURCE)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.data())
def test_nothing_but_a_typed_error_comes_of_any_header(data: st.DataObject) -> None:
    """The checksum made right again, as somebody who wants to do harm would."""
    changed = bytearray(to_bytes(SOURCE, content(held=3)))
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(8, len(changed) - 5))] = data.draw(st.integers(0, 255))
    changed[-4:] = struct.pack("<I", zlib.crc32(bytes(changed[:-4])))
    try:
        found = from_bytes(bytes(changed), SOURCE)
    except InputError:
        return
    assert found.compressed.numbers.shape[1] <= found.modes
    assert np.isfinite([found.compressed.step, found.compressed.remainder_step, found.compressed.check]).all()
    assert np.isfinite(found.compressed.held).all()


def test_no_more_numbers_than_bytes_can_hold() -> None:
    data = bytearray(to_bytes(SOURCE, content(maps=1, modes=1, remainder=False)))
    struct.pack_into("<II", data, 13 + 16 + 4, 100, 20_000)  # modes computed, maps
    struct.pack_into("<I", data, 13 + 16 + 12, 100)  # modes stored
    data[-4:] = struct.pack("<I", zlib.crc32(bytes(data[:-4])))
    with pytest.raises(InputError, match="not as many"):
        from_bytes(bytes(data), SOURCE)


def test_more_than_a_file_holds_is_not_written(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compressed_files, "MOST_NUMBERS", 833)
    with pytest.raises(InputError, match="834 numbers are more than one file holds, 833"):
        to_bytes(SOURCE, content())


def test_another_mesh_or_kind() -> None:
    data = to_bytes(SOURCE, content())
    with pytest.raises(InputError, match="another mesh"):
        from_bytes(data, Source("maps", MESH.points * (1.0 + 1e-12), MESH.tets))
    with pytest.raises(InputError, match="another mesh"):
        from_bytes(data, Source("maps", MESH.points, MESH.tets[::-1]))
    with pytest.raises(InputError, match="holds maps"):
        from_bytes(data, Source("frames", MESH.points, MESH.tets))


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_bytes(tmp_path / "none.qc3d")
    (tmp_path / "other.qc3d").write_bytes(b"PK" + bytes(500))
    with pytest.raises(InputError, match="not a file of compressed maps"):
        from_bytes(read_bytes(tmp_path / "other.qc3d"), SOURCE)
