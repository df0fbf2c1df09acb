# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d compress`` and ``qc3d decompress``: maps as small files, and back."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ..solver.array_files import replacing
from ..solver.compressed_files import CompressedMaps, read_compressed, write_compressed
from ..solver.compression import Boundary, Codec, Scheme
from ..solver.errors import InputError
from ..solver.mapping import Mapping
from ..solver.mapping_files import TARGET, TetFile, read_tets, write_tets
from ..solver.rate import Choice, quantised_coordinates, with_error, with_modes, with_size
from ..solver.tetmesh import TetMesh
from .options import whole_number

_MODES = 300


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add both commands to the others."""
    compress = commands.add_parser("compress", help="a map, or the maps of many frames, as a small file")
    compress.add_argument(
        "map", type=Path, metavar="MAP", help="tetrahedra with the array 'target' (N, 3), or (N, k, 3) for k frames"
    )
    compress.add_argument("--target", type=Path, metavar="FILE", help="the same tetrahedra with their vertices mapped")
    compress.add_argument("--output", type=Path, required=True, metavar="FILE.qc3d")
    compress.add_argument("--scheme", choices=get_args(Scheme), default="fitted", help="default: fitted")
    compress.add_argument("--boundary", choices=get_args(Boundary), default="sliding", help="default: sliding")
    amount = compress.add_mutually_exclusive_group(required=True)
    amount.add_argument("--modes", type=whole_number, metavar="K", help="the lowest K modes and nothing else")
    amount.add_argument(
        "--error", type=float, metavar="E", help="root mean square error allowed, over the bounding box's diagonal"
    )
    amount.add_argument("--size", type=whole_number, metavar="BYTES", help="for each map")
    compress.add_argument("--report", type=Path, metavar="REPORT.json", help="sizes, ratios, errors, folds")
    compress.set_defaults(run=_compress)

    decompress = commands.add_parser("decompress", help="the maps of a small file on their mesh")
    decompress.add_argument("file", type=Path, metavar="FILE.qc3d")
    decompress.add_argument("mesh", type=Path, metavar="MESH", help="the tetrahedra that the maps belong to")
    decompress.add_argument("--output", type=Path, required=True, metavar="MAP", help="the mesh with 'target'")
    decompress.set_defaults(run=_decompress)


def _compress(arguments: argparse.Namespace) -> None:
    mappings = _mappings(read_tets(arguments.map), arguments.target)
    mesh = mappings[0].mesh
    modes = _MODES if arguments.modes is None else arguments.modes
    codec = Codec(mesh, min(modes, len(mesh.points) - 2), arguments.scheme, arguments.boundary)
    choices = [_chosen(codec, mapping, arguments) for mapping in mappings]
    content = CompressedMaps(codec.spectrum.modes.shape[1], tuple(choice.compressed for choice in choices))
    size = write_compressed(arguments.output, mesh, content)
    report = _report(mappings, choices, size)
    if arguments.report is not None:
        with replacing(arguments.report) as unfinished:
            unfinished.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    print(
        f"{size} bytes, 1 : {report['ratio_to_raw']:.0f} of raw coordinates, 1 : {report['ratio_to_quantised']:.2f} of "
        f"quantised ones at the same error; error {max(report['error']):.2g}, folds {sum(report['folds'])}"
    )


def _decompress(arguments: argparse.Namespace) -> None:
    content = read_tets(arguments.mesh)
    mesh = content.mesh()
    compressed = read_compressed(arguments.file, mesh)
    codec = Codec(mesh, compressed.modes, compressed.scheme, compressed.boundary)
    values = np.stack([codec.restore(each).values for each in compressed.maps], axis=1)
    target = values[:, 0] if len(compressed.maps) == 1 else values
    write_tets(
        arguments.output, TetFile(mesh.points, mesh.tets, {**content.at_vertices, TARGET: target}, content.at_tets)
    )


def _mappings(content: TetFile, target: Path | None) -> list[Mapping]:
    values = content.at_vertices.get(TARGET)
    if target is not None or values is None or values.ndim != 3:
        return [content.mapping(None if target is None else read_tets(target))]
    if not values.shape[1]:
        raise InputError(f"The array '{TARGET}' has no frames.")
    return [Mapping.checked(content.points, content.tets, frame) for frame in values.transpose(1, 0, 2)]


def _chosen(codec: Codec, mapping: Mapping, arguments: argparse.Namespace) -> Choice:
    if arguments.modes is not None:
        return with_modes(codec, mapping, codec.spectrum.modes.shape[1])
    if arguments.error is not None:
        if not 0.0 < arguments.error < np.inf:
            raise InputError(f"The error {arguments.error} is not possible; give a number above 0.")
        return with_error(codec, mapping, arguments.error)
    return with_size(codec, mapping, arguments.size)


def _report(mappings: list[Mapping], choices: list[Choice], size: int) -> dict[str, Any]:
    """What was gained and what it cost, as plain values."""
    mesh: TetMesh = mappings[0].mesh
    diagonal = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    raw = 4 * mappings[0].values.size * len(mappings)  # in single precision
    quantised = sum(
        quantised_coordinates(mapping, max(choice.error, 1e-12))
        for mapping, choice in zip(mappings, choices, strict=True)
    )
    boundary = np.unique(mesh.boundary_faces)
    held = [mesh.on_cube_face if choice.compressed.boundary == "sliding" else boundary for choice in choices]
    return {
        "bytes": size,
        "raw_bytes": raw,
        "quantised_bytes": quantised,
        "ratio_to_raw": raw / size,
        "ratio_to_quantised": quantised / size,
        "modes": [len(choice.compressed.numbers) for choice in choices],
        "remainder": [len(choice.compressed.remainder) for choice in choices],
        "error": [choice.error for choice in choices],
        "mean_square_error": [(choice.error * diagonal) ** 2 for choice in choices],
        "boundary_error": [
            float(np.abs(choice.restored.values - mapping.values)[rows].max())
            for choice, mapping, rows in zip(choices, mappings, held, strict=True)
        ],
        "folds": [choice.restored.folds for choice in choices],
    }
