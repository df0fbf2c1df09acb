# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens in FBX files: a blend-shape channel with several target shapes, ordered by their full weights.

Blender's exporter writes one channel per shape key. With the parser and the encoder of Blender's FBX add-on, this
module adds the in-betweens to the channel of their key and removes the channels of the keys that play them in Blender.
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

# Separates the name of an element from its class.
_CLASS = b"\x00\x01"
_CREATOR = b"QC3D, on Blender's FBX exporter"
# Names of the encoder's methods, by the type codes of FBX properties.
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
        The file, which is replaced.
    data_name : str
        Name of the mesh data block.
    found : sequence of InBetweens
        The in-betweens of each key.

    Raises
    ------
    InputError
        If the file cannot be read or written, or has no channel for a key.
    """
    try:
        from io_scene_fbx import encode_bin, parse_fbx
    except ImportError as error:
        raise InputError("Blender's FBX add-on is disabled; enable it in the preferences.") from error
    try:
        parsed, version = parse_fbx.parse(str(path))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read as an FBX file: {reason(error)}; export it again.") from error
    file = _File(_plain(parsed), data_name)
    for key in found:
        file.add(key)
    file.remove(frozenset().union(*(key.made for key in found)))
    file.count()
    file.sign()
    encode_bin.write(str(path), _encoded(file.root, encode_bin), version)


class _Element:
    """An element of the file's tree: its name, its properties with their type codes, and its children."""

    def __init__(self, name: bytes, values: Sequence[Any], types: str, inside: Sequence[_Element] = ()) -> None:
        self.name, self.values, self.types, self.inside = name, list(values), types, list(inside)

    def child(self, name: bytes) -> _Element:
        found = next((element for element in self.inside if element.name == name), None)
        if found is None:
            raise InputError(f"The exported FBX file has no {name.decode()}; export it again.")
        return found


class _File:
    """The tree of a file, with the channels of one mesh."""

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
        """Insert the in-betweens before the target shape of the key's channel, and their full weights before its."""
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
        moved = moved if len(moved) else np.zeros(1, dtype=np.int64)  # programs refuse a shape without any points
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
        """Remove the channels of keys, their shapes, and their animation."""
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
        """Update the number of elements of each type in the Definitions."""
        total = 1  # the global settings, which are not among the objects
        for kind in self.root.child(b"Definitions").inside:
            if kind.name == b"ObjectType" and kind.values[0] != b"GlobalSettings":
                number = sum(element.name == kind.values[0] for element in self._objects.inside)
                kind.child(b"Count").values = [number]
                total += number
        self.root.child(b"Definitions").child(b"Count").values = [total]

    def sign(self) -> None:
        """Set the creator: some programs read full weights of files by Blender as weights of vertices."""
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
