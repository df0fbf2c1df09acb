# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens in glTF files: morph targets whose weights are animated with a value at every frame.

glTF has no drivers, and by default Blender exports no animation of driven keys. Therefore the values of all keys are
sampled at every frame, so that the motion is the same.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError, reason

_MAGIC, _VERSION, _JSON, _BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_HEADER, _CHUNK = struct.Struct("<III"), struct.Struct("<II")
_FLOAT = 5126


def set_weight_animation(
    path: Path, node: str, names: Sequence[str], seconds: NDArray[np.float64], values: NDArray[np.float64]
) -> None:
    """Replace the animation of a mesh's morph-target weights.

    Parameters
    ----------
    path : Path
        A binary file (.glb) that Blender has exported.
    node : str
        Name of the object.
    names : sequence of str
        Names of the shape keys, in the order of the columns of ``values``.
    seconds : (f,)
        Times, increasing.
    values : (f, k)
        Values of the keys at these times.

    Raises
    ------
    InputError
        If the file cannot be read, or has no such object with targets.
    """
    document, binary = _read(path)
    number, targets = _node(document, node, path)
    column = {name: index for index, name in enumerate(names)}
    missing = [name for name in targets if name not in column]
    if missing:
        raise InputError(f"{path.name} has a target '{missing[0]}' that is not a shape key; export it again.")
    weights = values[:, [column[name] for name in targets]]
    _drop_weights(document, number)
    data = bytearray(binary)
    inputs = _accessor(document, data, seconds, with_range=True)
    outputs = _accessor(document, data, weights.ravel())
    animations = document.setdefault("animations", [])
    if not animations:
        animations.append({"name": "Weights", "channels": [], "samplers": []})
    animation = animations[0]
    sampler = len(animation["samplers"])
    animation["samplers"].append({"input": inputs, "output": outputs, "interpolation": "LINEAR"})
    animation["channels"].append({"sampler": sampler, "target": {"node": number, "path": "weights"}})
    document["buffers"][0]["byteLength"] = len(data)
    _write(path, document, bytes(data))


def _accessor(
    document: dict[str, Any], data: bytearray, numbers: NDArray[np.float64], with_range: bool = False
) -> int:
    """Index of a new accessor of single-precision numbers (f,), which are appended to the binary data."""
    data.extend(bytes(-len(data) % 4))
    packed = numbers.astype("<f4")
    view = {"buffer": 0, "byteOffset": len(data), "byteLength": packed.nbytes}
    data.extend(packed.tobytes())
    document.setdefault("bufferViews", []).append(view)
    accessor: dict[str, Any] = {
        "bufferView": len(document["bufferViews"]) - 1,
        "componentType": _FLOAT,
        "count": len(packed),
        "type": "SCALAR",
    }
    if with_range:
        accessor |= {"min": [float(packed.min())], "max": [float(packed.max())]}
    document.setdefault("accessors", []).append(accessor)
    return len(document["accessors"]) - 1


def _drop_weights(document: dict[str, Any], node: int) -> None:
    """Remove the channels that animate a node's weights, and animations that become empty."""
    kept = []
    for animation in document.get("animations", []):
        animation["channels"] = [
            channel
            for channel in animation["channels"]
            if channel["target"].get("node") != node or channel["target"]["path"] != "weights"
        ]
        if animation["channels"]:
            kept.append(animation)
    document["animations"] = kept


def _node(document: dict[str, Any], name: str, path: Path) -> tuple[int, list[str]]:
    """Index of the node of that name, and the names of its mesh's targets."""
    for number, node in enumerate(document.get("nodes", [])):
        if node.get("name") == name and "mesh" in node:
            targets = document["meshes"][node["mesh"]].get("extras", {}).get("targetNames", [])
            if targets:
                return number, list(targets)
    raise InputError(f"{path.name} has no object '{name}' with shapes; remove its modifiers, or export it again.")


def _read(path: Path) -> tuple[dict[str, Any], bytes]:
    data = path.read_bytes()
    try:
        magic, version, length = _HEADER.unpack_from(data)
        size, kind = _CHUNK.unpack_from(data, _HEADER.size)
        start = _HEADER.size + _CHUNK.size
        document = json.loads(data[start : start + size])
        after = start + size
        binary_size, binary_kind = _CHUNK.unpack_from(data, after)
        binary = data[after + _CHUNK.size : after + _CHUNK.size + binary_size]
    except (struct.error, ValueError) as error:
        raise InputError(f"{path} is not a binary glTF file: {reason(error)}; choose a name ending in .glb.") from error
    if (magic, version, length, kind, binary_kind) != (_MAGIC, _VERSION, len(data), _JSON, _BINARY):
        raise InputError(f"{path} is not a binary glTF file of version 2; choose a name ending in .glb.")
    return document, binary


def _write(path: Path, document: dict[str, Any], binary: bytes) -> None:
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    length = _HEADER.size + 2 * _CHUNK.size + len(text) + len(binary)
    with path.open("wb") as file:
        file.write(_HEADER.pack(_MAGIC, _VERSION, length))
        file.write(_CHUNK.pack(len(text), _JSON) + text)
        file.write(_CHUNK.pack(len(binary), _BINARY) + binary)
