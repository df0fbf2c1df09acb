# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of fitted maps are read back unchanged, or refused."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.files import KeptMaps, read_maps, write_maps
from qc3d_addon.solver.settings import FitOptions

KEPT = KeptMaps(
    ("rest", "jäw", "rest", "jäw"),  # the way back and again: two maps
    FitOptions(stretch="logarithmic", extra_turns=-2, engine="delaunay", quality="finest", seed=7),
    {("rest", "jäw"): b"one", ("jäw", "rest"): b""},
)
FIXED = 14


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_maps(tmp_path / "maps.qc3dmap", KEPT)
    return tmp_path / "maps.qc3dmap"


def with_header(path: Path, **changes: Any) -> None:  # noqa: ANN401 - anything that JSON has
    data = path.read_bytes()
    end = FIXED + struct.unpack_from("<8sHI", data)[2]
    text = json.dumps(json.loads(data[FIXED:end]) | changes).encode()
    path.write_bytes(data[:10] + struct.pack("<I", len(text)) + text + data[end:])


def test_there_and_back(path: Path) -> None:
    found = read_maps(path)
    assert (found.through, found.options, found.maps) == (KEPT.through, KEPT.options, KEPT.maps)


def test_every_truncation_is_refused(path: Path) -> None:
    data = path.read_bytes()
    for length in range(len(data)):
        path.write_bytes(data[:length])
        with pytest.raises(InputError):
            read_maps(path)
    path.write_bytes(data + b"x")
    with pytest.raises(InputError, match="sizes of its maps do not fit"):
        read_maps(path)


def test_another_version(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[8] = 99
    path.write_bytes(data)
    with pytest.raises(InputError, match="has version 99; this program reads version 1"):
        read_maps(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"through": "rest"},
        {"through": ["rest"]},
        {"through": ["rest", 3]},
        {"through": None},
        {"sizes": [3]},
        {"sizes": [4, -1]},
        {"sizes": [3.0, 0]},
        {"sizes": [2**70, 0]},
        {"settings": {}},
        {"settings": {"stretch": "linear", "extra_turns": 0, "engine": "other", "quality": "finest", "seed": 0}},
        {"settings": {"stretch": "linear", "extra_turns": 0, "engine": "auto", "quality": "finest", "seed": 2**31}},
        {"settings": {"stretch": "linear", "extra_turns": "0", "engine": "auto", "quality": [], "seed": 0}},
    ],
)
def test_headers_that_make_no_sense(path: Path, changes: dict[str, Any]) -> None:
    with_header(path, **changes)
    with pytest.raises(InputError, match="is damaged"):
        read_maps(path)


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_nothing_but_a_typed_error_comes_of_damage(path: Path, data: st.DataObject) -> None:
    write_maps(path, KEPT)
    changed = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(changed)
    try:
        found = read_maps(path)
    except InputError:
        return
    assert sum(map(len, found.maps.values())) == 3


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_maps(tmp_path / "none.qc3dmap")
    (tmp_path / "other.qc3dmap").write_bytes(b"PK" + bytes(500))
    with pytest.raises(InputError, match="not a file of maps"):
        read_maps(tmp_path / "other.qc3dmap")
    with pytest.raises(InputError, match="cannot be written"):
        write_maps(tmp_path / "none" / "maps.qc3dmap", KEPT)
