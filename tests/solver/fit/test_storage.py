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
from qc3d_addon.solver.fit.continuation import FollowedPath, turns_along
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.fit.lattice import mesh_on_lattice, way_on_lattice
from qc3d_addon.solver.fit.storage import FORMAT_VERSION, fingerprint, from_bytes, to_bytes, why_unusable
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.meshing.slivers import triangulate
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import icosphere, jittered_grid, random_delaunay, sine_map

POINTS, FACES = icosphere(0)
PAIR = KeyPair.checked(POINTS, 1.1 * POINTS, FACES, [[0, 5]])


def fitted() -> FittedMap:
    mesh = jittered_grid(2, seed=1)
    half, full = (sine_map(mesh.points, np.full((1, 3), size), np.ones((1, 3, 3))) for size in (0.03, 0.06))
    maps = np.stack([mesh.points, half, full])
    turns = np.random.default_rng(0).normal(size=(len(mesh.tets), 3))
    options = FitOptions(quality="finest", extra_turns=2)
    return FittedMap.restored(PAIR, mesh, maps, turns, options, "delaunay", ("Ein Satz für dich – „so“.", "Two."))


def on_lattice(mesh: TetMesh, size: float = 0.05) -> FittedMap:
    """The same as the fit makes it: on a lattice, with turns that follow from the maps."""
    mesh = mesh_on_lattice(mesh)
    full = sine_map(mesh.points, np.full((1, 3), size), np.ones((1, 3, 3)))
    maps = mesh.points + np.linspace(0.0, 1.0, 4)[:, None, None] * (full - mesh.points)
    followed = way_on_lattice(mesh, FollowedPath(maps, turns_along(mesh, maps)))
    return FittedMap.restored(PAIR, mesh, followed.maps, followed.turns, FitOptions(), "delaunay")


STORED = to_bytes(fitted())
SEAL = hashlib.sha256().digest_size


def contents(data: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(data[SEAL:]), allow_pickle=False) as stored:
        found: dict[str, Any] = dict(stored)
    found["header"] = json.loads(bytes(found["header"]))
    return found


def plain() -> dict[str, Any]:
    """What version 4 stored."""
    whole, found = fitted(), contents(STORED)
    found["header"]["version"] = 4
    del found["header"]["counts"]
    arrays = {"points": whole.mesh.points, "tets": whole.mesh.tets.astype(np.int32), "maps": whole.maps}
    return {"header": found["header"], **arrays, "turns": whole.turns}


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

    def test_of_earlier_versions(self) -> None:
        assert_identical(from_bytes(sealed(plain()), PAIR), fitted())

    @settings(max_examples=20, deadline=None)
    @given(st.integers(0, 60), st.integers(0, 10**6))
    def test_on_a_lattice(self, count: int, seed: int) -> None:
        whole = on_lattice(random_delaunay(count, seed), 0.01)
        assert_identical(from_bytes(to_bytes(whole), PAIR), whole)

    def test_what_follows_from_the_rest_is_not_stored(self) -> None:
        points = np.round(random_delaunay(100, 1).points * 2.0**20) / 2.0**20
        delaunay = on_lattice(TetMesh(points, triangulate(points)), 0.01)
        data = to_bytes(delaunay)
        assert set(contents(data)) == {"header", "points", "maps"}
        assert_identical(from_bytes(data, PAIR), delaunay)
        other = FittedMap.restored(
            PAIR, delaunay.mesh, delaunay.maps, delaunay.turns + 2.0 * np.pi, FitOptions(), "delaunay"
        )
        assert set(contents(to_bytes(other))) == {"header", "points", "maps", "turns"}
        assert_identical(from_bytes(to_bytes(other), PAIR), other)

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
        found = plain()
        for name, value in changes.items():
            if value is None:
                del found[name]
            else:
                found[name] = value
        with pytest.raises(InputError, match=words):
            from_bytes(sealed(found), PAIR)

    def test_nothing_changed(self) -> None:
        assert_identical(from_bytes(sealed(contents(STORED)), PAIR), fitted())

    def test_a_lattice_that_is_none(self) -> None:
        found = contents(STORED)
        found["points"] = np.concatenate([[np.uint8(21)], found["points"][1:]])
        with pytest.raises(InputError, match="damaged"):
            from_bytes(sealed(found), PAIR)

    def test_another_version(self) -> None:
        header = {**contents(STORED)["header"], "version": 99}
        self.refused("has format 99, this version reads 5; fit the keys", header=header)

    @pytest.mark.parametrize(
        ("version", "said"),
        [
            (FORMAT_VERSION, None),
            (FORMAT_VERSION - 1, None),
            (FORMAT_VERSION - 2, None),
            (FORMAT_VERSION - 3, "was made by an earlier version of QC3D"),
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
        header = plain()["header"]
        del header[name]
        self.refused("damaged", header=header)

    def test_a_header_that_is_none(self) -> None:
        self.refused("damaged", header=[1, 2])
        self.refused("damaged", header=np.frombuffer(b"{", dtype=np.uint8))
        self.refused("damaged", header=np.frombuffer(b"\xff\xfe", dtype=np.uint8))

    def test_objects_are_not_unpickled(self) -> None:
        self.refused("damaged", points=np.array([print, None], dtype=object))

    @pytest.mark.parametrize(
        "counts", [[0, 1, 2], [27, 0, 3], [27, 162, 1], [2**40, 162, 3], [26, 162, 3], [27, 1, 3], "x", None]
    )
    def test_counts(self, counts: object) -> None:
        found = contents(STORED)
        found["header"]["counts"] = counts
        with pytest.raises(InputError, match="damaged"):
            from_bytes(sealed(found), PAIR)

    @pytest.mark.parametrize("name", ["points", "maps", "tets"])
    def test_arrays_of_this_version(self, name: str) -> None:
        whole = contents(STORED)[name]
        changes = (whole[: len(whole) // 2], whole.astype(np.int32), whole[None], whole[:0])
        for other in (*changes, np.full(40, 255, dtype=np.uint8)):
            with pytest.raises(InputError, match="damaged"):
                from_bytes(sealed({**contents(STORED), name: other}), PAIR)

    def test_arrays_that_do_not_fit_together(self) -> None:
        found = plain()
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
        array = plain()[name].copy()
        array.flat[20] = number
        self.refused("damaged", **{name: array})

    def test_folds(self) -> None:
        found = plain()
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
