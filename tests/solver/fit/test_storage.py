# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A stored map is restored bit for bit, or refused."""

from __future__ import annotations

import hashlib
import io
import json
import pickle
import zipfile
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.lib import format as npy

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.fit.storage import FORMAT_VERSION, fingerprint, from_bytes, to_bytes, why_unusable
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions

from ..meshes import icosphere, jittered_grid, sine_map

POINTS, FACES = icosphere(0)
PAIR = KeyPair.checked(POINTS, 1.1 * POINTS, FACES, [[0, 5]])


def fitted() -> FittedMap:
    mesh = jittered_grid(2, seed=1)
    half, full = (sine_map(mesh.points, np.full((1, 3), size), np.ones((1, 3, 3))) for size in (0.03, 0.06))
    maps = np.stack([mesh.points, half, full])
    turns = np.random.default_rng(0).normal(size=(len(mesh.tets), 3))
    options = FitOptions(quality="finest", extra_turns=2)
    return FittedMap.restored(PAIR, mesh, maps, turns, options, "delaunay", ("Ein Satz für dich – „so“.", "Two."))


STORED = to_bytes(fitted())
SEAL = hashlib.sha256().digest_size


def contents(data: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(data[SEAL:]), allow_pickle=False) as stored:
        found: dict[str, Any] = dict(stored)
    found["header"] = json.loads(bytes(found["header"]))
    return found


def sealed(found: dict[str, Any]) -> bytes:
    """Whole bytes, whatever they hold."""
    buffer = io.BytesIO()
    if isinstance(found.get("header"), (dict, list)):
        found["header"] = np.frombuffer(json.dumps(found["header"]).encode(), dtype=np.uint8)
    np.savez_compressed(buffer, **found)
    return hashlib.sha256(buffer.getvalue()).digest() + buffer.getvalue()


def assert_identical(found: FittedMap, expected: FittedMap) -> None:
    assert found.pair is PAIR
    for one, other in (
        (found.mesh.points, expected.mesh.points),
        (found.mesh.tets, expected.mesh.tets),
        (found.maps, expected.maps),
        (found.turns, expected.turns),
    ):
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    assert (found.engine, found.notes, found.options) == (expected.engine, expected.notes, expected.options)


def assert_refused_or_identical(data: bytes) -> None:
    try:
        found = from_bytes(data, PAIR)
    except InputError:
        return
    assert_identical(found, fitted())


class TestRoundTrip:
    def test_bit_for_bit(self) -> None:
        assert_identical(from_bytes(STORED, PAIR), fitted())

    def test_again_and_again(self) -> None:
        assert_identical(from_bytes(to_bytes(from_bytes(STORED, PAIR)), PAIR), fitted())

    def test_the_keys_are_not_stored(self) -> None:
        for array in (PAIR.key0, PAIR.key1):
            assert array.tobytes()[:64] not in STORED


class TestFingerprint:
    def test_of_equal_pairs(self) -> None:
        again = KeyPair.checked(POINTS.tolist(), (1.1 * POINTS).tolist(), FACES.astype(np.int32), [[0, 5]])
        assert fingerprint(again) == fingerprint(PAIR)
        assert_identical(from_bytes(STORED, PAIR), fitted())

    @pytest.mark.parametrize(
        "other",
        [
            KeyPair.checked(1.1 * POINTS, POINTS, FACES, [[0, 5]]),
            KeyPair.checked(POINTS, 1.1 * POINTS * (1.0 + 1e-15), FACES, [[0, 5]]),
            KeyPair.checked(POINTS, 1.1 * POINTS, FACES[::-1], [[0, 5]]),
            KeyPair.checked(POINTS, 1.1 * POINTS, FACES[:-1], [[0, 5]]),
            KeyPair.checked(POINTS, 1.1 * POINTS, FACES),
            KeyPair.checked(POINTS[:-1], 1.1 * POINTS[:-1], FACES[:0]),
        ],
    )
    def test_other_keys_are_refused(self, other: KeyPair) -> None:
        assert fingerprint(other) != fingerprint(PAIR)
        with pytest.raises(InputError, match="belongs to other keys"):
            from_bytes(STORED, other)


class TestDamage:
    @pytest.mark.parametrize("data", [b"", b"PK", b"no map at all", bytes(1000), STORED[:-1], STORED[1:], STORED[::-1]])
    def test_foreign_bytes_are_refused(self, data: bytes) -> None:
        with pytest.raises(InputError, match="fit the keys again"):
            from_bytes(data, PAIR)

    @pytest.mark.parametrize("data", [pickle.dumps(fitted().maps), b"\x93NUMPY" + bytes(100)])
    def test_other_formats_of_numpy_are_refused(self, data: bytes) -> None:
        with pytest.raises(InputError, match="fit the keys again"):
            from_bytes(data, PAIR)

    @settings(max_examples=300)
    @given(st.integers(0, len(STORED) - 1), st.integers(1, 255))
    def test_one_other_byte(self, place: int, change: int) -> None:
        data = bytearray(STORED)
        data[place] ^= change
        assert_refused_or_identical(bytes(data))

    @settings(max_examples=200)
    @given(st.lists(st.tuples(st.integers(0, len(STORED) - 1), st.binary(min_size=1, max_size=8)), min_size=1))
    def test_other_bytes_here_and_there(self, changes: list[tuple[int, bytes]]) -> None:
        data = bytearray(STORED)
        for place, piece in changes:
            data[place : place + len(piece)] = piece
        assert_refused_or_identical(bytes(data))

    @settings(max_examples=100)
    @given(st.integers(0, len(STORED) - 1))
    def test_cut_off(self, length: int) -> None:
        with pytest.raises(InputError, match="fit the keys again"):
            from_bytes(STORED[:length], PAIR)

    @settings(max_examples=100)
    @given(st.binary(max_size=300))
    def test_anything(self, data: bytes) -> None:
        with pytest.raises(InputError, match="fit the keys again"):
            from_bytes(data, PAIR)


class TestWrongContents:
    """Whole bytes that hold something else: of another version, or made up."""

    @staticmethod
    def refused(words: str, **changes: Any) -> None:  # noqa: ANN401
        found = contents(STORED)
        for name, value in changes.items():
            if value is None:
                del found[name]
            else:
                found[name] = value
        with pytest.raises(InputError, match=words):
            from_bytes(sealed(found), PAIR)

    def test_nothing_changed(self) -> None:
        assert_identical(from_bytes(sealed(contents(STORED)), PAIR), fitted())

    def test_another_version(self) -> None:
        header = {**contents(STORED)["header"], "version": 99}
        self.refused("has format 99, this version reads 4; fit the keys", header=header)

    @pytest.mark.parametrize(
        ("version", "said"),
        [
            (FORMAT_VERSION, None),
            (FORMAT_VERSION - 1, None),
            (FORMAT_VERSION - 2, "was made by an earlier version of QC3D"),
            (FORMAT_VERSION + 1, "was made by a later version of QC3D"),
            ("1", "is damaged"),
            (None, "is damaged"),
            ([1], "is damaged"),
        ],
    )
    def test_what_is_said_of_a_version_without_unpacking(self, version: object, said: str | None) -> None:
        changed = contents(STORED)
        changed["header"]["version"] = version
        assert why_unusable(sealed(changed)) == said

    @pytest.mark.parametrize("data", [b"", STORED[:-1], STORED[:SEAL], STORED[:-1] + b"x", b"x" * 100])
    def test_what_is_said_of_damage(self, data: bytes) -> None:
        assert why_unusable(data) == "is damaged"

    @pytest.mark.parametrize("header", [b"", b"{", b"[]", b"7", b"[" * 100_000, b"\xff"])
    def test_what_is_said_of_a_header_that_is_none(self, header: bytes) -> None:
        changed = {**contents(STORED), "header": np.frombuffer(header, dtype=np.uint8)}
        assert why_unusable(sealed(changed)) == "is damaged"

    @pytest.mark.parametrize("name", ["header", "points", "tets", "maps", "turns"])
    def test_a_part_is_missing(self, name: str) -> None:
        self.refused("damaged", **{name: None})

    @pytest.mark.parametrize("name", ["version", "fingerprint", "engine", "notes", "options"])
    def test_a_part_of_the_header_is_missing(self, name: str) -> None:
        header = contents(STORED)["header"]
        del header[name]
        self.refused("damaged", header=header)

    def test_a_header_that_is_none(self) -> None:
        self.refused("damaged", header=[1, 2])
        self.refused("damaged", header=np.frombuffer(b"{", dtype=np.uint8))
        self.refused("damaged", header=np.frombuffer(b"\xff\xfe", dtype=np.uint8))

    def test_objects_are_not_unpickled(self) -> None:
        self.refused("damaged", points=np.array([print, None], dtype=object))

    def test_arrays_that_do_not_fit_together(self) -> None:
        found = contents(STORED)
        self.refused("damaged", points=found["points"][:, :2])
        self.refused("damaged", points=found["points"][:-1])
        self.refused("damaged", maps=found["maps"][:1])
        self.refused("damaged", maps=found["maps"][:, :-1])
        self.refused("damaged", maps=found["maps"][0])
        self.refused("damaged", turns=found["turns"][:-1])
        self.refused("damaged", tets=found["tets"][:, :3])
        self.refused("damaged", tets=found["tets"][:0])
        self.refused("damaged", tets=found["tets"] + 1)
        self.refused("damaged", tets=found["tets"] - 1)

    @pytest.mark.parametrize("name", ["points", "maps", "turns"])
    @pytest.mark.parametrize("number", [np.nan, np.inf])
    def test_numbers_that_are_none(self, name: str, number: float) -> None:
        array = contents(STORED)[name].copy()
        array.flat[20] = number
        self.refused("damaged", **{name: array})

    def test_folds(self) -> None:
        found = contents(STORED)
        self.refused("damaged", tets=found["tets"][:, [1, 0, 2, 3]])
        self.refused("damaged", maps=found["maps"] * [1.0, 1.0, -1.0])
        self.refused("damaged", maps=found["maps"] * [1.0, 1.0, 0.0])
        self.refused("damaged", points=found["points"] * [1.0, 0.0, 1.0])


@pytest.mark.parametrize("shape", [(2**40, 3), (2**62, 2**62), (1, 3)])
def test_an_array_that_is_not_as_large_as_it_says(shape: tuple[int, int]) -> None:
    buffer = io.BytesIO(STORED[SEAL:])
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(buffer) as whole:
        entries = {name: whole.read(name) for name in whole.namelist()}
    entries["points.npy"] = header.getvalue() + bytes(240)
    changed = io.BytesIO()
    with zipfile.ZipFile(changed, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    with pytest.raises(InputError, match="damaged"):
        from_bytes(hashlib.sha256(changed.getvalue()).digest() + changed.getvalue(), PAIR)
