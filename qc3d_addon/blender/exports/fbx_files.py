# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens in FBX files: one blend-shape channel with its shapes in the order of their full weights.

Blender's exporter writes one channel for each shape key. Its own reader and writer of FBX's tree of elements put the
shapes of in-betweens into the channel of their key, and take the channels out that play them in Blender.
"""

from __future__ import annotations

import array
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError, reason
from .in_betweens import InBetweens

# What ends a name, before the kind of what has it.
_CLASS = b"\x00\x01"
_CREATOR = b"QC3D, on Blender's FBX exporter"
# How FBX's types of properties are added.
_ADDED_BY = {
    "Y": "int16", "Z": "int8", "B": "bool", "C": "char", "I": "int32", "F": "float32", "D": "float64", "L": "int64",
    "R": "bytes", "S": "string", "f": "float32_array", "i": "int32_array", "d": "float64_array", "l": "int64_array",
    "b": "bool_array", "c": "byte_array",
}  # fmt: skip


def add_in_betweens(path: Path, data_name: str, found: Sequence[InBetweens]) -> None:
    """Write in-betweens into a file that Blender has exported.

    Parameters
    ----------
    path : Path
    data_name : str
        Name of the mesh's data.
    found : sequence of InBetweens

    Raises
    ------
    InputError
        If the file cannot be read or written, or has no such channel.
    """
    try:
        from io_scene_fbx import encode_bin, parse_fbx
    except ImportError as error:
        raise InputError("Blender's FBX add-on is switched off; enable it in the preferences.") from error
    try:
        parsed, version = parse_fbx.parse(str(path))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} is no FBX file that can be read: {reason(error)}; export it again.") from error
    file = _File(_plain(parsed), data_name)
    for key in found:
        file.add(key)
    file.remove(frozenset().union(*(key.made for key in found)))
    file.count()
    file.sign()
    encode_bin.write(str(path), _encoded(file.root, encode_bin), version)


class _Element:
    """An element of the tree: its name, properties with their types, and what is in it."""

    def __init__(self, name: bytes, values: Sequence[Any], types: str, inside: Sequence[_Element] = ()) -> None:
        self.name, self.values, self.types, self.inside = name, list(values), types, list(inside)

    def child(self, name: bytes) -> _Element:
        found = next((element for element in self.inside if element.name == name), None)
        if found is None:
            raise InputError(f"The exported FBX file has no {name.decode()}; export it again.")
        return found


class _File:
    """The tree of a file, and in it the channels of one mesh."""

    def __init__(self, root: _Element, data_name: str) -> None:
        self.root = root
        self._objects, self._links = root.child(b"Objects"), root.child(b"Connections")
        mesh = self._named(b"Geometry", data_name, b"Mesh", self._objects.inside)
        self._mesh = int(mesh.values[0])
        self._mesh_properties = mesh.child(b"Properties70")
        deformers = [link.values[1] for link in self._links.inside if link.values[2] == self._mesh]
        of_mesh = {link.values[1] for link in self._links.inside if link.values[2] in deformers}
        self._channels = [
            element
            for element in self._objects.inside
            if element.values[2] == b"BlendShapeChannel" and element.values[0] in of_mesh
        ]
        self._free = 1 + max(int(element.values[0]) for element in self._objects.inside)

    def add(self, key: InBetweens) -> None:
        """Put shapes before the one of the key's channel, and their weights before its own."""
        channel = self._named(b"Deformer", key.key, b"BlendShapeChannel", self._channels)
        at = next(
            number
            for number, link in enumerate(self._links.inside)
            if link.values[2] == channel.values[0] and link.values[0] == b"OO"
        )
        links = []
        for place, offsets in zip(key.places.tolist(), key.offsets, strict=True):
            self._objects.inside.append(self._shape(f"{key.key}_{100.0 * place:.4g}", offsets))
            links.append(_Element(b"C", [b"OO", self._free, channel.values[0]], "SLL"))
            self._free += 1
        self._links.inside[at:at] = links
        percents = array.array("d", [*(100.0 * key.places), 100.0])
        channel.child(b"FullWeights").values = [percents]

    def _shape(self, name: str, offsets: NDArray[np.float64]) -> _Element:
        moved = np.flatnonzero((offsets != 0.0).any(axis=1))
        moved = moved if len(moved) else np.zeros(1, dtype=np.int64)  # a shape without any points is refused by readers
        vectors = array.array("d", offsets[moved].ravel())
        inside = [
            _Element(b"Properties70", [], ""),
            _Element(b"Version", [100], "I"),
            _Element(b"Indexes", [array.array("i", moved.astype(np.int32))], "i"),
            _Element(b"Vertices", [vectors], "d"),
            _Element(b"Normals", [array.array("d", bytes(8 * len(vectors)))], "d"),
        ]
        return _Element(b"Geometry", [self._free, name.encode() + _CLASS + b"Geometry", b"Shape"], "LSS", inside)

    def remove(self, names: frozenset[str]) -> None:
        """Take out the channels of keys, their shapes, and what animates them."""
        encoded = {name.encode() for name in names}
        gone = {element.values[0] for element in self._channels if _name(element) in encoded}
        gone |= {link.values[1] for link in self._links.inside if link.values[2] in gone}
        # What animates them as properties of the mesh.
        gone |= {
            link.values[1]
            for link in self._links.inside
            if link.values[0] == b"OP" and link.values[2] == self._mesh and link.values[3] in encoded
        }
        gone |= {link.values[1] for link in self._links.inside if link.values[2] in gone and link.values[0] == b"OP"}
        self._objects.inside = [element for element in self._objects.inside if element.values[0] not in gone]
        self._links.inside = [link for link in self._links.inside if not {link.values[1], link.values[2]} & gone]
        kept = [element for element in self._mesh_properties.inside if element.values[0] not in encoded]
        self._mesh_properties.inside = kept

    def count(self) -> None:
        """Bring up to date how many there are of each kind."""
        total = 1  # the global settings, which are no object
        for kind in self.root.child(b"Definitions").inside:
            if kind.name == b"ObjectType" and kind.values[0] != b"GlobalSettings":
                number = sum(element.name == kind.values[0] for element in self._objects.inside)
                kind.child(b"Count").values = [number]
                total += number
        self.root.child(b"Definitions").child(b"Count").values = [total]

    def sign(self) -> None:
        """Say who wrote the file: readers that see Blender's name take full weights for those of vertices."""
        header = self.root.child(b"FBXHeaderExtension")
        for element in (self.root.child(b"Creator"), header.child(b"Creator")):
            element.values = [_CREATOR]

    def _named(self, element: bytes, name: str, kind: bytes, among: Iterable[_Element]) -> _Element:
        for found in among:
            if found.name == element and found.values[2] == kind and _name(found) == name.encode():
                return found
        raise InputError(f"The exported FBX file has no shape or mesh '{name}'; export it again.")


def _name(element: _Element) -> bytes:
    return bytes(element.values[1]).split(_CLASS)[0]


def _plain(parsed: Any) -> _Element:  # noqa: ANN401 - of Blender's reader, which has no types
    inside = [_plain(element) for element in parsed.elems if element is not None]
    return _Element(parsed.id, parsed.props, bytes(parsed.props_type).decode(), inside)


def _encoded(element: _Element, encode_bin: Any) -> Any:  # noqa: ANN401
    encoded = encode_bin.FBXElem(element.name)
    for kind, value in zip(element.types, element.values, strict=True):
        getattr(encoded, f"add_{_ADDED_BY[kind]}")(value)
    encoded.elems.extend(_encoded(inside, encode_bin) for inside in element.inside)
    return encoded
