# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged and invented files of every kind that is read."""

from __future__ import annotations

import io
import json
import os
import pickle
import struct
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from qc3d_addon.cli.reconstruct import read_landmarks
from qc3d_addon.solver.compression import compact
from qc3d_addon.solver.compression import files as compressed_files
from qc3d_addon.solver.compression.compressed import Compressed
from qc3d_addon.solver.compression.fields import Field, Part, Space
from qc3d_addon.solver.compression.pack import small_frames, small_maps, unpacked
from qc3d_addon.solver.compression.smallest import Wanted, smallest
from qc3d_addon.solver.fit import files as map_files
from qc3d_addon.solver.fit import storage
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.frames import remade
from qc3d_addon.solver.frames.bake_settings import Settings
from qc3d_addon.solver.keys.files import read_pairs
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.maps.files import TetFile, read_tets, write_tets
from qc3d_addon.solver.settings import FitOptions, FrameOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.tets.mesh import TetMesh

from ..solver.meshes import icosphere, jittered_grid

Random = np.random.Generator
KEYS = ("a", "b")
_NAMES = ["plain", "with space", "new\nline", "\x1b[31mred", "tab\tand\rreturn", "ä→猫", "bell\a", "a" * 200, "\udcff"]
_HUGE = [2**20, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1, -1]


@dataclass
class FileCase:
    """A file to read, and what reads it."""

    path: Path
    story: str
    reader: Callable[[Path], None]

    def read(self) -> str:
        """Read the file; what came of it in a word."""
        self.reader(self.path)
        return "read"


def make(random: Random, folder: Path) -> FileCase:
    """A case in an empty folder."""
    formats = list(_FORMATS)
    name = formats[int(random.integers(len(formats)))]
    ending, whole, reader = _FORMATS[name]
    path = folder / f"{_NAMES[int(random.integers(len(_NAMES)))] if random.random() < 0.3 else 'file'}{ending}"
    story = [name]
    if random.random() < 0.12:
        story.append(_strange_place(path, whole(), random))
    else:
        data = whole()
        for _ in range(random.choice(3, p=[0.05, 0.75, 0.2])):
            choices = [*_DAMAGES, *(_ARCHIVE_DAMAGES * (data[:2] == b"PK")), *(_TEXT_DAMAGES * (name in _TEXTS))]
            damage = choices[int(random.integers(len(choices)))]
            story.append(damage.__name__.strip("_").replace("_", " "))
            data = damage(data, random)
        path.write_bytes(data)
    return FileCase(path, ", ".join(story), reader)


def warm_up() -> None:
    """Make the whole files that all cases start from, which takes memory of its own."""
    for _, whole, _ in _FORMATS.values():
        whole()


STRAIGHT = FrameOptions(mode="straight")  # bakes in no time


@cache
def _mesh() -> TetMesh:
    return jittered_grid(2, seed=1)


@cache
def _pair() -> KeyPair:
    points, faces = icosphere(0)
    return KeyPair.checked(points, 1.1 * points, faces)


@cache
def _shapes() -> bytes:
    pair, buffer = _pair(), io.BytesIO()
    np.savez(buffer, faces=pair.faces, shape_names=np.array(KEYS), V0=pair.key0, V1=pair.key1)
    return buffer.getvalue()


@cache
def _compressed_shapes() -> bytes:
    pair, buffer = _pair(), io.BytesIO()
    np.savez_compressed(buffer, faces=pair.faces, shape_names=np.array(KEYS), V0=pair.key0, V1=pair.key1)
    return buffer.getvalue()


def _moved() -> np.ndarray[Any, Any]:
    mesh = _mesh()
    return np.where(mesh.on_cube_face, mesh.points, 0.98 * mesh.points + 0.01)


@cache
def _stored_map() -> bytes:
    mesh = _mesh()
    maps = np.stack([mesh.points, _moved()])
    turns = np.zeros((len(mesh.tets), 3))
    fitted = FittedMap.restored(_pair(), mesh, maps, turns, FitOptions(), "delaunay", ("Two.",))
    return storage.to_bytes(fitted)


@cache
def _maps() -> bytes:
    return _written(
        ".qc3dmap",
        lambda path: map_files.write_maps(path, map_files.KeptMaps(KEYS, FitOptions(), {KEYS: _stored_map()})),
    )


@cache
def _spectral() -> bytes:
    random = np.random.default_rng(0)
    numbers, rest = random.integers(-9, 10, size=(2, 6, 6)), random.integers(-2, 3, size=(2, len(_mesh().points), 3))
    compressed = Compressed("fitted", "sliding", 0.01, numbers, np.empty((2, 0, 3)), 0.25, 0.002, rest)
    content = compressed_files.Content(6, compressed, (1.0, 2.0, 3.0, 0.5))
    return compressed_files.to_bytes(_source(), content)


def _source() -> compressed_files.Source:
    return compressed_files.Source("maps", _mesh().points, _mesh().tets)


def _tets(ending: str) -> Callable[[], bytes]:
    @cache
    def made() -> bytes:
        mesh = _mesh()
        content = TetFile(mesh.points, mesh.tets, {"target": _moved()}, {"stretch": np.ones((len(mesh.tets), 6))})
        return _written(ending, lambda path: write_tets(path, content))

    return made


def _written(ending: str, write: Callable[[Path], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{ending}"
        write(path)
        return path.read_bytes()


def _landmarks() -> bytes:
    return b"vertex,x,y,z\n0,0.1,0.2,0.3\n5,,0.5,\n7,1e-3,2,3\n"


def _read_shapes(path: Path) -> None:
    read_pairs(path, KEYS)


def _read_tets(path: Path) -> None:
    found = read_tets(path)
    found.mesh()
    found.mapping()


def _read_maps(path: Path) -> None:
    kept = map_files.read_maps(path)
    for data in kept.maps.values():
        storage.from_bytes(data, _pair())


def _read_stored(path: Path) -> None:
    storage.from_bytes(path.read_bytes() if path.is_file() and path.stat().st_size < 2**24 else b"", _pair())


def _read_compressed(path: Path) -> None:
    compressed_files.from_bytes(compressed_files.read_bytes(path), _source())


@cache
def _small(kind: str) -> bytes:
    """A small file as the command makes it: of maps, of frames, or of frames that are baked again."""
    if kind == "maps":
        return finish(small_maps(_mesh(), np.stack([_moved(), _mesh().points]), 1e-3)).data
    if kind == "frames":
        return finish(small_frames(_frames(), _pair().faces, 1e-4)).data
    space, settings = Space(_pair().key0, _pair().faces), Settings((0, 3), (), frame_options=STRAIGHT)
    keys = finish(smallest(Wanted(space, _frames()[-1:] - _pair().key0, 1.0, 1e-3)))
    remaking = compact.Remaking(remade.packed_settings(settings, remade.Inputs(_frame_source())), keys, 1e-3, 0.0)
    nothing = Field(Part("plain", 0, 0.0, np.zeros((3, 12, 3), dtype=np.int64)))
    return compact.to_bytes(_frame_source(), space, compact.Packed("frames", "sliding", 3, nothing, None, remaking))


def _frames() -> np.ndarray[Any, Any]:
    return _pair().key0 * np.linspace(1.0, 1.2, 4)[:, None, None]


def _frame_source() -> compressed_files.Source:
    return compressed_files.Source("frames", _pair().key0, _pair().faces)


def _read_small_maps(path: Path) -> None:
    unpacked(compressed_files.read_bytes(path), _source())


def _read_small_frames(path: Path) -> None:
    finish(remade.restored(compressed_files.read_bytes(path), remade.Inputs(_frame_source())))


_FORMATS: dict[str, tuple[str, Callable[[], bytes], Callable[[Path], None]]] = {
    "shapes": (".npz", _shapes, _read_shapes),
    "compressed shapes": (".npz", _compressed_shapes, _read_shapes),
    "tetrahedra as arrays": (".npz", _tets(".npz"), _read_tets),
    "tetrahedra .vtu": (".vtu", _tets(".vtu"), _read_tets),
    "tetrahedra .vtk": (".vtk", _tets(".vtk"), _read_tets),
    "tetrahedra .msh": (".msh", _tets(".msh"), _read_tets),
    "tetrahedra .mesh": (".mesh", _tets(".mesh"), _read_tets),
    "a stored map": (".map", _stored_map, _read_stored),
    "maps": (".qc3dmap", _maps, _read_maps),
    "compressed maps": (".qc3dspec", _spectral, _read_compressed),
    "small maps": (".qc3d", lambda: _small("maps"), _read_small_maps),
    "small frames": (".qc3d", lambda: _small("frames"), _read_small_frames),
    "frames to bake again": (".qc3d", lambda: _small("remade"), _read_small_frames),
    "landmarks": (".csv", _landmarks, lambda path: read_landmarks(path) and None),
}
_TEXTS = {"landmarks", "tetrahedra .mesh", "tetrahedra .vtu"}


def _strange_place(path: Path, data: bytes, random: Random) -> str:
    """Put at ``path`` what is no ordinary file; says what."""
    kind = int(random.integers(8))
    if kind == 0:
        path.mkdir()
        return "a folder"
    if kind == 1:
        os.mkfifo(path)
        return "a pipe that nobody writes to"
    if kind == 2:
        path.write_bytes(b"")
        return "an empty file"
    if kind == 3:
        return "no file"
    goals = {4: path, 5: Path("/dev/zero"), 6: path.with_name("nothing"), 7: path.with_name("whole")}
    goals[7].write_bytes(data)
    path.symlink_to(goals[kind])
    return {4: "a link to itself", 5: "a link to /dev/zero", 6: "a link to nothing", 7: "a link to a whole file"}[kind]


def _cut_off(data: bytes, random: Random) -> bytes:
    return data[: int(random.integers(len(data) + 1))]


def _other_bytes(data: bytes, random: Random) -> bytes:
    changed = bytearray(data)
    for place in random.integers(max(len(data), 1), size=int(random.integers(1, 9))) if data else []:
        changed[place] = int(random.integers(256))
    return bytes(changed)


def _other_bits_at_the_beginning(data: bytes, random: Random) -> bytes:
    changed = bytearray(data)
    for place in random.integers(min(max(len(data), 1), 120), size=int(random.integers(1, 5))) if data else []:
        changed[place] ^= 1 << int(random.integers(8))
    return bytes(changed)


def _a_piece_gone(data: bytes, random: Random) -> bytes:
    start, end = sorted(random.integers(len(data) + 1, size=2).tolist())
    return data[:start] + data[end:]


def _a_piece_twice(data: bytes, random: Random) -> bytes:
    start, end = sorted(random.integers(len(data) + 1, size=2).tolist())
    return data[:end] + data[start:]


def _something_else(data: bytes, random: Random) -> bytes:
    return [
        pickle.dumps({"faces": [1, 2, 3]}),
        b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999999,), }",
        b"PK\x03\x04",
        b"\x00" * 1000,
        b"<?xml version='1.0'?><!DOCTYPE a [<!ENTITY b 'bbbb'><!ENTITY c '&b;&b;&b;'>]><VTKFile>&c;</VTKFile>",
        random.bytes(int(random.integers(1, 3000))),
        b"$MeshFormat\n2.2 1 8\n",
        b"\xff\xfe" * 20,
        json.dumps({"through": ["a"] * 1000}).encode(),
        b"[" * 100_000,
    ][int(random.integers(10))]


def _a_huge_number(data: bytes, random: Random) -> bytes:
    """Sizes that are declared somewhere, made huge."""
    number = _HUGE[int(random.integers(len(_HUGE)))]
    place = int(random.integers(max(min(len(data), 400), 1)))
    size, code = (4, "<I") if random.random() < 0.5 else (8, "<Q")
    return data[:place] + struct.pack(code, number % 2 ** (8 * size)) + data[place + size :]


def _archive(data: bytes) -> dict[str, bytes] | None:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
    except Exception:  # damaged before
        return None


def _packed(entries: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def _changed_entry(data: bytes, random: Random, change: Callable[[bytes], bytes]) -> bytes:
    entries = _archive(data)
    if not entries:
        return data
    name = list(entries)[int(random.integers(len(entries)))]
    try:
        entries[name] = change(entries[name])
    except (ValueError, MemoryError):  # no array any more
        return data
    return _packed(entries)


def _array_of_another_size(data: bytes, random: Random) -> bytes:
    shapes = [(2**40, 3), (2**62, 2**62), (10**8, 3), (0,), (), (1, 3), (3, 0), (2**31,), (5, 5, 5)]
    kinds = ["<f8", "<i8", "|O", "<U1000000", "|V8", "<c16", "|b1", ">f4", "<M8[s]"]

    def change(entry: bytes) -> bytes:
        header = io.BytesIO()
        described = {"descr": kinds[int(random.integers(len(kinds)))] if random.random() < 0.5 else "<f8"}
        shape = shapes[int(random.integers(len(shapes)))]
        npy.write_array_header_1_0(header, {**described, "fortran_order": False, "shape": shape})  # type: ignore
        return header.getvalue() + entry[128:]

    return _changed_entry(data, random, change)


def _pickled_objects(data: bytes, random: Random) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.array([os.getcwd, "x"], dtype=object), allow_pickle=True)
    return _changed_entry(data, random, lambda entry: buffer.getvalue())


def _a_header_that_is_none(data: bytes, random: Random) -> bytes:
    texts = [b"{'descr': __import__('os'), }", b"{" * 5000, b"", b"(" * 9000, b"{'descr': '<f8', 'shape': (1e9,)}"]
    text = texts[int(random.integers(len(texts)))]
    return _changed_entry(data, random, lambda entry: b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text)


def _a_bomb(data: bytes, random: Random) -> bytes:
    """60 MB of zeros in an entry of 60 kB."""
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (2_600_000, 3)})  # type: ignore
    return _changed_entry(data, random, lambda entry: header.getvalue() + bytes(24 * 2_600_000))


def _entries_of_other_names(data: bytes, random: Random) -> bytes:
    entries = _archive(data)
    if not entries:
        return data
    odd = ["../../evil.npy", "/etc/passwd.npy", "a\nb.npy", "\x1b[31m.npy", "no_ending", "V0", "ä.npy", ""]
    renamed = {odd[k % len(odd)] if random.random() < 0.4 else name: e for k, (name, e) in enumerate(entries.items())}
    return _packed(renamed)


def _numbers_that_are_none(data: bytes, random: Random) -> bytes:
    def change(entry: bytes) -> bytes:
        try:
            array = np.load(io.BytesIO(entry), allow_pickle=False)
        except Exception:  # it was damaged before; numpy raises all kinds
            return entry
        if array.dtype.kind == "f" and array.size:
            array.flat[int(random.integers(array.size))] = [np.nan, np.inf, -np.inf, 1e300][int(random.integers(4))]
        elif array.dtype.kind in "iu" and array.size:
            array.flat[int(random.integers(array.size))] = [-1, 2**31 - 1, 100][int(random.integers(3))] % 2**31
        elif array.dtype.kind == "U":
            array = np.array(["a", _NAMES[int(random.integers(len(_NAMES) - 1))]])
        buffer = io.BytesIO()
        np.save(buffer, array)
        return buffer.getvalue()

    return _changed_entry(data, random, change)


def _other_words(data: bytes, random: Random) -> bytes:
    words = data.split(b" ") if b" " in data else data.split(b",")
    odd = [b"nan", b"-1", b"1e400", b"99999999999", b"\xc3\x28", b"", b"0x1F", b"\x00", b"inf", b'"', b"1_000", b"<a>"]
    for place in random.integers(len(words), size=int(random.integers(1, 5))):
        words[place] = odd[int(random.integers(len(odd)))]
    return (b" " if b" " in data else b",").join(words)


_DAMAGES = [
    _cut_off,
    _other_bytes,
    _other_bits_at_the_beginning,
    _a_piece_gone,
    _a_piece_twice,
    _something_else,
    _a_huge_number,
]
_ARCHIVE_DAMAGES = [
    _array_of_another_size,
    _array_of_another_size,
    _pickled_objects,
    _a_header_that_is_none,
    _a_bomb,
    _entries_of_other_names,
    _numbers_that_are_none,
    _numbers_that_are_none,
]
_TEXT_DAMAGES = [_other_words] * 4
