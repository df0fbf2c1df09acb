# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d decompress``: the maps or frames of a small file."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..solver.arrays import Floats
from ..solver.compression import frames as frame_compression
from ..solver.compression.codec import Codec
from ..solver.compression.compact import is_compact
from ..solver.compression.files import Source, from_bytes, read_bytes
from ..solver.compression.pack import unpacked
from ..solver.files.atomic import replacing, require_writable
from ..solver.files.npz import write_arrays
from ..solver.frames.remade import restored
from ..solver.maps.files import TARGET, TetFile, read_tets, require_format, write_tets
from ..solver.support.progress import finish
from .frame_files import holds, read_inputs
from .options import print_notes
from .progress_bars import StageBars


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    decompress = commands.add_parser("decompress", help="the maps or frames of a small file")
    decompress.add_argument("file", type=Path, metavar="FILE.qc3d")
    decompress.add_argument(
        "mesh", type=Path, metavar="MESH", help="the tetrahedra; for frames an .npz file with faces and key0"
    )
    decompress.add_argument("--output", type=Path, required=True, metavar="FILE", help="the mesh with all of it")
    decompress.set_defaults(run=_decompress)


def _decompress(arguments: argparse.Namespace) -> None:
    require_writable(arguments.output, inputs=[arguments.file, arguments.mesh])
    data = read_bytes(arguments.file)
    if holds(arguments.mesh, "key0"):
        _frames(data, arguments.mesh, arguments.output)
        return
    content = read_tets(arguments.mesh)
    require_format(arguments.output)
    print_notes(content.notes)
    mesh = content.mesh()
    values = _maps(data, Source("maps", mesh.points, mesh.tets)).transpose(1, 0, 2)
    target = values[:, 0] if values.shape[1] == 1 else values
    write_tets(
        arguments.output, TetFile(mesh.points, mesh.tets, {**content.at_vertices, TARGET: target}, content.at_tets)
    )


def _maps(data: bytes, source: Source) -> Floats:
    """(F, N, 3) the maps of a file of whichever version."""
    if is_compact(data):
        return unpacked(data, source)
    stored = from_bytes(data, source)
    return Codec(source.mesh, stored.modes, stored.compressed.scheme, stored.compressed.boundary).restore(
        stored.compressed
    )


def _frames(data: bytes, path: Path, output: Path) -> None:
    inputs = read_inputs(path)
    source = inputs.source
    first = source.points
    if is_compact(data):
        with StageBars() as bars:
            later = finish(restored(data, inputs), bars)
        frames = np.concatenate([first[None], later])
    else:
        frames = frame_compression.restored(first, from_bytes(data, source))
    arrays = {"faces": source.cells, "frames": frames, "key0": first, "key1": frames[-1]}
    with replacing(output) as unfinished:
        write_arrays(unfinished, arrays)
