# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Archives crafted to exhaust memory: allocations are counted, and the error is one sentence."""

from __future__ import annotations

import bz2
import io
import lzma
import struct
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.cli.main import main
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.storage import from_bytes
from qc3d_addon.solver.keys import files as key_files
from qc3d_addon.solver.keys.files import read_pairs
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.maps.files import read_tets
from qc3d_addon.solver.support import memory

from .archives import FACES, POINTS, SHAPES, Builder, array, bomb, header, long_list, with_entry, without

# What reading may take before it refuses; each of the files would take several times that.
MOST = 32 * 2**20
LIMIT_MB = 2000
NAMES = ("a", "b")


@pytest.fixture(autouse=True)
def machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine of which a bake may use 2 GB."""
    for module in (memory, key_files):
        monkeypatch.setattr(module, "machine_limit_mb", lambda: LIMIT_MB)


@pytest.fixture(autouse=True)
def limited() -> Iterator[None]:
    """No test takes more than a gigabyte, whatever it finds."""
    resource = pytest.importorskip("resource", reason="limits memory as Linux and macOS do")
    kind, before = resource.RLIMIT_DATA, resource.getrlimit(resource.RLIMIT_DATA)
    held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    resource.setrlimit(kind, (held + 2**30, before[1]))
    yield
    resource.setrlimit(kind, before)


def refusal(read: Callable[[], object]) -> str:
    """The sentence that reading ends with, once it is sure that it allocated little."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as caught:
            read()
        taken = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert taken < MOST, f"{taken} bytes: {caught.value}"
    assert str(caught.value).endswith(".")
    return str(caught.value)


def pairs(path: Path) -> Callable[[], object]:
    return lambda: read_pairs(path, NAMES)


class TestNames:
    @pytest.mark.parametrize("first", ["V0", "V0.npy"])
    def test_a_name_with_and_without_its_ending(self, first: str, tmp_path: Path) -> None:
        # The one would be looked at, the other be read.
        builder = Builder(tmp_path / "odd.npz", without("V0"))
        for name in (first, "V0" if first == "V0.npy" else "V0.npy"):
            if name == "V0":
                builder.zeros(name, (2**28,), "|i1", header((2**28,), "|i1"))
            else:
                builder.entry(name, array(POINTS))
        builder.close()
        assert "holds 'V0', which is no array" in refusal(pairs(tmp_path / "odd.npz"))

    def test_a_name_twice(self, tmp_path: Path) -> None:
        builder = Builder(tmp_path / "odd.npz", SHAPES)
        with pytest.warns(UserWarning, match="Duplicate name"):
            builder.zeros("V0.npy", (2**28,), "|i1")
        builder.close()
        assert "holds two arrays named 'V0'" in refusal(pairs(tmp_path / "odd.npz"))

    @pytest.mark.parametrize("name", ["readme.txt", "V7", "V0.NPY", "npy", "folder/"])
    def test_what_is_no_array(self, name: str, tmp_path: Path) -> None:
        Builder(tmp_path / "odd.npz", SHAPES).entry(name, b"").close()
        assert f"holds {name!r}, which is no array" in refusal(pairs(tmp_path / "odd.npz"))

    @pytest.mark.parametrize("entries", [90_000, 200_000])
    def test_a_list_without_end(self, entries: int, tmp_path: Path) -> None:
        long_list(tmp_path / "odd.npz", entries)
        assert "is not an .npz file of arrays" in refusal(pairs(tmp_path / "odd.npz"))

    def test_ten_thousand_shapes_are_read(self, tmp_path: Path) -> None:
        builder = Builder(tmp_path / "many.npz", {"faces": FACES})
        builder.entry("shape_names.npy", array(np.array([f"shape {number}" for number in range(10_000)])))
        content = array(POINTS.astype(np.float32))
        for number in range(10_000):
            builder.entry(f"V{number}.npy", content, zipfile.ZIP_STORED)
        builder.close()
        assert len(read_pairs(tmp_path / "many.npz", ("shape 0", "shape 9999"))) == 1


class TestSizes:
    @pytest.mark.parametrize("kind", ["<U0", "|S0", "|V0"])
    @pytest.mark.parametrize("name", ["shape_names", "V0", "faces"])
    def test_items_without_a_size(self, name: str, kind: str, tmp_path: Path) -> None:
        shape = (10**9,) if name == "shape_names" else (10**9, 3)
        Builder(tmp_path / "odd.npz", without(name)).entry(f"{name}.npy", header(shape, kind)).close()
        assert "its items have no size" in refusal(pairs(tmp_path / "odd.npz"))

    def test_more_names_than_shapes(self, tmp_path: Path) -> None:
        Builder(tmp_path / "odd.npz", without("shape_names")).zeros("shape_names.npy", (2**26,), "<U1").close()
        assert "names 67108864 shapes, and the file holds 4 arrays" in refusal(pairs(tmp_path / "odd.npz"))

    @pytest.mark.parametrize("kind", ["|i1", "|u1", "<f2", "<f4"])
    def test_keys_that_are_small_until_they_are_numbers(self, kind: str, tmp_path: Path) -> None:
        builder = Builder(tmp_path / "odd.npz", without("V0", "V1"))
        builder.zeros("V0.npy", (16_000_000, 3), kind).zeros("V1.npy", (16_000_000, 3), kind).close()
        assert (tmp_path / "odd.npz").stat().st_size < 1_000_000
        said = refusal(pairs(tmp_path / "odd.npz"))
        assert "The bake of 16000000 vertices needs about 84905 MB of memory, and its limit is 2000 MB" in said

    def test_triangles_count_too(self, tmp_path: Path) -> None:
        Builder(tmp_path / "odd.npz", without("faces")).zeros("faces.npy", (32_000_000, 3), "|u1").close()
        assert "needs about 84905 MB of memory" in refusal(pairs(tmp_path / "odd.npz"))

    def test_frames_count_too(self, tmp_path: Path) -> None:
        builder = Builder(tmp_path / "odd.npz", without("V0", "V1"))
        builder.zeros("V0.npy", (300_000, 3), "|i1").zeros("V1.npy", (300_000, 3), "|i1").close()
        path = tmp_path / "odd.npz"
        assert "its limit is 2000" in refusal(lambda: read_pairs(path, NAMES, frames=100, needs_fits=False))
        assert read_pairs(path, NAMES, frames=2, needs_fits=False)

    @pytest.mark.parametrize("shape", [(16_000_000,), (4_000_000, 4), (1, 16_000_000, 3), ()])
    def test_keys_of_other_shapes(self, shape: tuple[int, ...], tmp_path: Path) -> None:
        Builder(tmp_path / "odd.npz", without("V0")).zeros("V0.npy", shape, "|i1").close()
        assert "positions must be (n, 3)" in refusal(pairs(tmp_path / "odd.npz"))

    def test_the_sum_of_all_arrays(self, tmp_path: Path) -> None:
        builder = Builder(tmp_path / "odd.npz", {"points": POINTS, "tets": np.array([[0, 1, 2, 3]])})
        for number in range(12):
            builder.zeros(f"more{number}.npy", (2**25,), "|i1")
        builder.close()
        said = refusal(lambda: read_tets(tmp_path / "odd.npz"))
        assert "take 3221225" in said
        assert "of memory, and at most 2147483648 are read" in said

    def test_tetrahedra_that_are_too_many(self, tmp_path: Path) -> None:
        builder = Builder(tmp_path / "odd.npz", {"points": POINTS}).zeros("tets.npy", (2_000_000, 4), "|u1")
        builder.close()
        said = refusal(lambda: read_tets(tmp_path / "odd.npz"))
        assert said.startswith("A mesh of 2000000 tetrahedra and 12 vertices needs about")

    def test_a_header_of_a_hundred_megabytes(self, tmp_path: Path) -> None:
        start = b"\x93NUMPY\x02\x00" + struct.pack("<I", 100 * 2**20)
        Builder(tmp_path / "odd.npz", without("V0")).zeros("V0.npy", (100 * 2**20,), "|i1", start).close()
        assert "The array V0 in" in refusal(pairs(tmp_path / "odd.npz"))

    @pytest.mark.parametrize("shape", ["(-5, 3)", "(2**70, 0)", "(-1, -3)", "(True, 3)", "(5, 3, -0)", "(2.0, 3)"])
    def test_shapes_that_are_none(self, shape: str, tmp_path: Path) -> None:
        text = f"{{'descr': '|i1', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
        entry = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text
        Builder(tmp_path / "odd.npz", without("V0")).entry("V0.npy", entry).close()
        refusal(pairs(tmp_path / "odd.npz"))

    @pytest.mark.parametrize(
        "kind",
        ["('<f8',)", "()", "[]", "[('a',)]", "[1]", "('<f8', (2147483648, 4))", "None", "{}", "'<f9'", "'U9999999999'"],
    )
    def test_kinds_of_numbers_that_are_none(self, kind: str, tmp_path: Path) -> None:
        text = f"{{'descr': {kind}, 'fortran_order': False, 'shape': (12, 3), }}\n".encode()
        entry = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text
        Builder(tmp_path / "odd.npz", without("V0")).entry("V0.npy", entry).close()
        refusal(pairs(tmp_path / "odd.npz"))

    def test_frames_to_compress(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        Builder(tmp_path / "odd.npz", {"faces": FACES}).zeros("frames.npy", (4000, 4000, 3), "|i1").close()
        arguments = ["compress", str(tmp_path / "odd.npz"), "--modes", "3", "--output", str(tmp_path / "out.qc3d")]
        tracemalloc.start()
        try:
            assert main(arguments) == 2
            assert tracemalloc.get_traced_memory()[1] < MOST
        finally:
            tracemalloc.stop()
        assert "Work on 4000 frames of 4000 vertices needs about 3690 MB" in capsys.readouterr().err

    def test_stored_maps(self) -> None:
        from qc3d_addon.solver.fit import storage

        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for name in ("header", "points", "maps", "turns", "tets"):
                archive.writestr(f"{name}.npy", header((2**28, 0), "|i1"))
            archive.writestr("points", header((10**9,), "<U0"))
        data = storage._seal(buffer.getvalue()) + buffer.getvalue()
        pair = KeyPair.checked(POINTS, 1.1 * POINTS, FACES)
        assert refusal(lambda: from_bytes(data, pair)) == "The stored map is damaged; fit the keys again."


class TestOtherMethods:
    """Of these it is not known how much they make of little; numpy does not write them."""

    @pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
    def test_a_bomb_behind_the_array(self, method: int, tmp_path: Path) -> None:
        bomb(tmp_path / "odd.npz", method, 100)
        assert (tmp_path / "odd.npz").stat().st_size < 50_000
        assert "compressed by a method that numpy does not write" in refusal(pairs(tmp_path / "odd.npz"))

    @pytest.mark.parametrize("method", [1, 6, 9, 12, 14, 93, 95, 98, 99, 65535])
    @pytest.mark.parametrize(
        "packed", [b"", b"\x00" * 100, b"\xff" * 100, b"\x09\x04\x05\x00\x5d\xff\xff\xff\xff" + b"\x7a" * 60]
    )
    def test_damaged(self, method: int, packed: bytes, tmp_path: Path) -> None:
        with_entry(tmp_path / "odd.npz", "V0", packed, method, len(array(POINTS)), 1)
        said = refusal(pairs(tmp_path / "odd.npz"))
        assert said.startswith(f"The array V0 in {tmp_path / 'odd.npz'} cannot be read: ")

    @pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
    def test_whole_ones_are_refused_too(self, method: int, tmp_path: Path) -> None:
        Builder(tmp_path / "odd.npz", without("V0")).entry("V0.npy", array(POINTS), method).close()
        said = refusal(pairs(tmp_path / "odd.npz"))
        assert "compressed by a method that numpy does not write; export it again" in said

    def test_every_byte_of_a_compressed_array_changed(self, tmp_path: Path) -> None:
        # LZMA and bzip2 were the reason; deflated ones must end in a sentence or in the same array.
        content = array(POINTS)
        for compress, method in ((bz2.compress, 12), (lzma.compress, 14), (lambda data: zlib.compress(data)[2:-4], 8)):
            packed = compress(content)
            for place in range(0, len(packed), 7):
                changed = bytearray(packed)
                changed[place] ^= 0x55
                with_entry(tmp_path / "odd.npz", "V0", bytes(changed), method, len(content), zlib.crc32(content))
                refusal(pairs(tmp_path / "odd.npz"))


def test_what_is_not_looked_at_may_be_anything(tmp_path: Path) -> None:
    builder = Builder(tmp_path / "more.npz", SHAPES)
    objects = io.BytesIO()
    np.save(objects, np.array([print, None], dtype=object), allow_pickle=True)
    builder.entry("info.npy", objects.getvalue()).entry("odd.npy", b"", zipfile.ZIP_LZMA)
    builder.zeros("large.npy", (2**28,), "|i1").close()
    assert len(read_pairs(tmp_path / "more.npz", NAMES)) == 1
