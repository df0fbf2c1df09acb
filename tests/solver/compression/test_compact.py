# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small files: what is damaged or hostile ends in a typed error, in little time and memory."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.compression.compact import Packed, from_bytes, space_of, to_bytes
from qc3d_addon.solver.compression.fields import Field, Part
from qc3d_addon.solver.compression.files import Source
from qc3d_addon.solver.compression.pack import unpacked
from qc3d_addon.solver.errors import InputError

from ..meshes import icosphere, jittered_grid

MESH = jittered_grid(4, seed=0)
SOURCE = Source("maps", MESH.points, MESH.tets)
BALL = Source("frames", *icosphere(2))
RANDOM = np.random.default_rng(0)


def _file(source: Source, kind: str, has_factors: bool) -> bytes:
    space = space_of(source, "fixed")
    numbers = RANDOM.integers(-3, 4, size=(2, 5 if kind == "modes" else len(source.points), 3))
    factors = RANDOM.integers(-9, 9, size=(6, 2)) if has_factors else None
    field = Field(Part(kind, 0, 0.01, numbers), factors, 5)
    boundary = "fixed" if source.kind == "maps" else "sliding"
    return to_bytes(source, space, Packed(source.kind, boundary, 6 if has_factors else 2, field))


FILES = [
    (source, _file(source, kind, has_factors))
    for source in (SOURCE, BALL)
    for kind in ("plain", "levels", "modes")
    for has_factors in (False, True)
]


@pytest.mark.parametrize("number", range(len(FILES)))
def test_there_and_back(number: int) -> None:
    source, data = FILES[number]
    packed, space = from_bytes(data, source)
    again, _ = from_bytes(to_bytes(source, space, packed), source)
    np.testing.assert_array_equal(again.field.part.numbers, packed.field.part.numbers)
    assert (again.field.part.kind, again.field.factor_bits) == (packed.field.part.kind, packed.field.factor_bits)
    assert unpacked(data, source).shape == (packed.count, *source.points.shape)


@pytest.mark.parametrize("number", range(len(FILES)))
def test_every_truncation_and_every_changed_byte_is_refused(number: int) -> None:
    source, data = FILES[number]
    for place in range(0, len(data), 1 + len(data) // 100):
        changed = bytearray(data)
        changed[place] ^= 1 + place % 255
        for damaged in (data[:place], bytes(changed)):
            with pytest.raises(InputError):
                from_bytes(damaged, source)


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_nothing_but_a_typed_error_comes_of_any_header(data: st.DataObject) -> None:
    """The checksum made right again, as somebody who wants to do harm would."""
    source, whole = FILES[data.draw(st.integers(0, len(FILES) - 1))]
    changed = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(6, min(40, len(changed) - 5)))] = data.draw(st.integers(0, 255))
    changed[-4:] = struct.pack("<I", zlib.crc32(bytes(changed[:-4])))
    with suppress(InputError):
        assert np.isfinite(unpacked(bytes(changed), source)).all()


@pytest.mark.parametrize("count", [2**21, 2**32 - 1])
def test_many_maps_out_of_few_bytes(count: int) -> None:
    data = bytearray(FILES[0][1])
    varint = bytes([*(count >> shift & 127 | 128 for shift in range(0, 28, 7)), count >> 28])
    data[7:8] = varint
    data[-4:] = struct.pack("<I", zlib.crc32(bytes(data[:-4])))
    tracemalloc.start()
    with pytest.raises(InputError, match="larger than can be read"):
        from_bytes(bytes(data), SOURCE)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 2_000_000


def test_versions_and_what_is_no_file() -> None:
    data = FILES[0][1]
    with pytest.raises(InputError, match="version 4; this program reads 3"):
        from_bytes(data[:3] + b"\x04" + data[4:], SOURCE)
    for other in (b"", b"PK" + bytes(99), b"QC3DSPEC" + bytes(200)):
        with pytest.raises(InputError, match="not a file of compressed maps"):
            from_bytes(other, SOURCE)
