# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files are checked before they are opened, arrays before they are allocated; several files are written or none."""

from __future__ import annotations

import io
import os
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.lib import format as npy

from qc3d_addon.cli.reconstruct import read_landmarks
from qc3d_addon.solver.compression.files import Source, from_bytes, read_bytes
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit.files import read_maps
from qc3d_addon.solver.keys.files import read_pairs
from qc3d_addon.solver.maps.files import read_tets

from ..meshes import icosphere, kuhn_grid

POINTS, FACES = icosphere(0)
ARRAYS = {"faces": FACES, "shape_names": np.array(["a", "b"]), "V0": POINTS, "V1": 1.1 * POINTS}


def read_shapes(path: Path) -> None:
    read_pairs(path, ("a", "b"))


READERS: list[Callable[[Path], object]] = [
    read_shapes,
    read_tets,
    lambda path: read_tets(path.with_suffix(".vtu")),
    read_maps,
    read_landmarks,
    lambda path: from_bytes(read_bytes(path), Source("maps", kuhn_grid(1).points, kuhn_grid(1).tets)),
]


@pytest.mark.parametrize("read", READERS)
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="makes pipes and looks at devices")
class TestWhatIsNoFile:
    def both(self, folder: Path, make: Callable[[Path], object]) -> Path:
        for ending in (".npz", ".vtu"):
            make(folder / f"odd{ending}")
        return folder / "odd.npz"

    def test_a_pipe_that_nobody_writes_to(self, read: Callable[[Path], object], tmp_path: Path) -> None:
        path = self.both(tmp_path, os.mkfifo)
        with pytest.raises(InputError, match="is no file that can be read"):
            read(path)

    def test_a_device_that_never_ends(self, read: Callable[[Path], object], tmp_path: Path) -> None:
        path = self.both(tmp_path, lambda path: path.symlink_to("/dev/zero"))
        with pytest.raises(InputError, match="is no file that can be read"):
            read(path)

    def test_a_folder(self, read: Callable[[Path], object], tmp_path: Path) -> None:
        path = self.both(tmp_path, Path.mkdir)
        with pytest.raises(InputError, match="is no file that can be read"):
            read(path)

    def test_a_link_to_itself(self, read: Callable[[Path], object], tmp_path: Path) -> None:
        path = self.both(tmp_path, lambda path: path.symlink_to(path))
        with pytest.raises(InputError, match="cannot be read: Too many levels of symbolic links"):
            read(path)

    def test_a_file_of_more_than_can_be_held(self, read: Callable[[Path], object], tmp_path: Path) -> None:
        def make(path: Path) -> None:
            with path.open("wb") as file:
                file.truncate(2**31 + 1)  # takes no room: nothing is in it

        path = self.both(tmp_path, make)
        with pytest.raises(InputError, match=r"has 2147483649 bytes, and at most \d+ are read"):
            read(path)


def test_a_link_to_a_whole_file_is_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "whole.npz", **ARRAYS)
    (tmp_path / "link.npz").symlink_to(tmp_path / "whole.npz")
    read_shapes(tmp_path / "link.npz")


def test_a_file_that_is_missing_cannot_be_exported_again(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.npz cannot be read: .*; name a file that exists"):
        read_shapes(tmp_path / "none.npz")


@pytest.mark.parametrize("shape", [(2**40, 3), (2**62, 2**62), (10**9, 3), (1, 3)])
def test_sizes_are_compared_before_anything_is_allocated(shape: tuple[int, ...], tmp_path: Path) -> None:
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": shape})
    save(tmp_path / "odd.npz", "V1.npy", header.getvalue() + bytes(240))
    with pytest.raises(InputError, match=r"The array V1 in .* cannot be read: it is not as large as it says; export"):
        read_shapes(tmp_path / "odd.npz")


def test_objects_are_refused_by_their_header(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    np.save(buffer, np.array([print, None], dtype=object), allow_pickle=True)
    save(tmp_path / "odd.npz", "V0.npy", buffer.getvalue())
    with pytest.raises(InputError, match="it holds objects of Python, which are never read"):
        read_shapes(tmp_path / "odd.npz")
    (tmp_path / "pickle.npz").write_bytes(pickle.dumps(ARRAYS))
    with pytest.raises(InputError, match=r"is not an \.npz file of arrays"):
        read_shapes(tmp_path / "pickle.npz")


TEXTS = [b"{" * 5000, b"(" * 9000, b"", b"{'descr': __import__('os'), }", b"\xff", b"{'shape': 3}"]


@pytest.mark.parametrize("text", TEXTS)
def test_headers_that_are_none(text: bytes, tmp_path: Path) -> None:
    entry = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    save(tmp_path / "odd.npz", "V0.npy", entry)
    with pytest.raises(InputError, match=r"The array V0 in .* cannot be read: .*; export it again"):
        read_shapes(tmp_path / "odd.npz")


@pytest.mark.parametrize(
    "text",
    ["{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999999,), }", "{'descr': '<f8'\\\n", "", "((((("],
)
def test_a_single_array_is_not_even_looked_into(text: str, tmp_path: Path) -> None:
    (tmp_path / "odd.npz").write_bytes(b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode())
    with pytest.raises(InputError, match=r"is not an \.npz file of arrays; faces, shape_names"):
        read_shapes(tmp_path / "odd.npz")


def test_names_that_would_control_a_terminal_are_shown_as_text(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_shapes(tmp_path / "new\nline\x1b[31m.npz")
    assert "new\\nline\\x1b[31m.npz cannot be read" in str(caught.value)


def test_a_very_long_text_is_cut() -> None:
    assert len(str(InputError(f"Wrong: {'9' * 10_000}."))) < 1010


def save(path: Path, name: str, content: bytes) -> None:
    """Write an archive in which one entry is something else."""
    buffer = io.BytesIO()
    np.savez(buffer, **ARRAYS)  # type: ignore[arg-type]
    with zipfile.ZipFile(buffer) as whole, zipfile.ZipFile(path, "w") as archive:
        for entry in whole.namelist():
            archive.writestr(entry, content if entry == name else whole.read(entry))
