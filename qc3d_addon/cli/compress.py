# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d compress`` and ``qc3d decompress``: maps and frames as small files, and back."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from ..solver.arrays import Floats, Ints
from ..solver.compression import frames as frame_compression
from ..solver.compression.codec import Boundary, Codec, Scheme
from ..solver.compression.files import Packer, Source, read_compressed
from ..solver.compression.search import Choice, Compressor
from ..solver.compression.transfer_loss import transferred
from ..solver.errors import InputError
from ..solver.files.atomic import replacing, replacing_all, require_writable
from ..solver.files.npz import open_archive, write_arrays
from ..solver.keys.keypair import KeyPair
from ..solver.maps.boundary_conditions import Conditions
from ..solver.maps.files import TARGET, TetFile, read_tets, require_format, write_tets
from ..solver.maps.mapping import Mapping
from ..solver.support.memory import require_memory_for_frames
from . import speech
from .options import output_files, print_notes, whole_number, write_json

_MODES = 300


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add both commands to the others."""
    compress = commands.add_parser("compress", help="a map, or the frames of a chain, as a small file")
    compress.add_argument(
        "map",
        type=Path,
        metavar="FILE",
        help="tetrahedra with the array 'target' (N, 3), or (N, k, 3) for k maps; or FRAMES.npz of interpolate",
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
    amount.add_argument("--size", type=whole_number, metavar="BYTES", help="of the file")
    compress.add_argument("--report", type=Path, metavar="REPORT.json", help="sizes, ratios, errors, folds")
    compress.set_defaults(run=_compress)

    decompress = commands.add_parser("decompress", help="the maps or frames of a small file")
    decompress.add_argument("file", type=Path, metavar="FILE.qc3d")
    decompress.add_argument(
        "mesh", type=Path, metavar="MESH", help="the tetrahedra; for frames an .npz file with faces and key0"
    )
    decompress.add_argument("--output", type=Path, required=True, metavar="FILE", help="the mesh with all of it")
    decompress.set_defaults(run=_decompress)


class _Job(NamedTuple):
    compressor: Compressor
    packer: Packer


def _compress(arguments: argparse.Namespace) -> None:
    if arguments.error is not None and not 0.0 < arguments.error < np.inf:
        raise InputError(f"The error {arguments.error} is not possible; give a number above 0.")
    files = output_files(arguments)
    require_writable(*files, inputs=[arguments.map, arguments.target])
    job = _frames_job(arguments) if _is_frames(arguments.map) else _maps_job(arguments)
    choice = _chosen(job.compressor, arguments)
    data = job.packer.bytes_of(choice.compressed)
    report = _report(job.compressor, choice, len(data))
    with replacing_all(*files) as (output, *report_files):
        output.write_bytes(data)
        for report_file in report_files:
            write_json(report_file, report)
    speech.say(
        f"{len(data)} bytes, 1 : {report['ratio_to_raw']:.0f} of raw coordinates, 1 : "
        f"{report['ratio_to_quantised']:.2f} of quantised ones at the same error; error {choice.error:.2g}, folds "
        f"{sum(choice.folds)}"
    )


def _chosen(compressor: Compressor, arguments: argparse.Namespace) -> Choice:
    if arguments.modes is not None:
        return compressor.with_modes(compressor.codec.modes)
    if arguments.error is not None:
        return compressor.with_error(arguments.error)
    return compressor.with_size(arguments.size)


def _decompress(arguments: argparse.Namespace) -> None:
    require_writable(arguments.output, inputs=[arguments.file, arguments.mesh])
    if _holds(arguments.mesh, "key0"):
        first, faces = _first_frame(arguments.mesh)
        source = frame_compression.source_of(first, faces)
        frames = frame_compression.restored(first, read_compressed(arguments.file, source))
        with replacing(arguments.output) as unfinished:
            write_arrays(unfinished, {"faces": faces, "frames": frames, "key0": first, "key1": frames[-1]})
        return
    content = read_tets(arguments.mesh)
    require_format(arguments.output)
    print_notes(content.notes)
    mesh = content.mesh()
    stored = read_compressed(arguments.file, Source("maps", mesh.points, mesh.tets))
    codec = Codec(mesh, stored.modes, stored.compressed.scheme, stored.compressed.boundary)
    values = codec.restore(stored.compressed).transpose(1, 0, 2)
    target = values[:, 0] if values.shape[1] == 1 else values
    write_tets(
        arguments.output, TetFile(mesh.points, mesh.tets, {**content.at_vertices, TARGET: target}, content.at_tets)
    )


def _maps_job(arguments: argparse.Namespace) -> _Job:
    content = read_tets(arguments.map)
    print_notes(content.notes)
    mappings = _mappings(content, arguments.target)
    mesh = mappings[0].mesh
    modes = min(_MODES if arguments.modes is None else arguments.modes, len(mesh.points) - 2)
    codec = Codec(mesh, modes, arguments.scheme, arguments.boundary)
    packer = Packer(Source("maps", mesh.points, mesh.tets), modes)
    return _Job(Compressor(codec, np.stack([mapping.values for mapping in mappings]), packer), packer)


def _frames_job(arguments: argparse.Namespace) -> _Job:
    if arguments.scheme != "fitted" or arguments.boundary != "sliding" or arguments.target is not None:
        raise InputError("Frames are compressed by the scheme fitted with a sliding boundary; leave those options out.")
    with open_archive(arguments.map, "faces and frames are needed") as archive:
        header = archive.headers(("frames", "faces"))["frames"]
        if len(header.shape) != 3 or header.dtype.kind not in "fiu" or not header.rows:
            raise InputError(f"The frames in {arguments.map} must be numbers of the shape (k, n, 3).")
        require_memory_for_frames(*header.shape[:2])
        frames, faces = archive.read(("frames", "faces")).values()
    # Every frame is a key of a pair with the first, and checked as such.
    pairs = [KeyPair.checked(frames[0], frame, faces) for frame in frames]
    positions = np.stack([pair.key1 for pair in pairs])
    modes = min(frame_compression.MOST_MODES if arguments.modes is None else arguments.modes, _MODES)
    compressor = frame_compression.compressor(positions, pairs[0].faces, modes)
    return _Job(compressor, compressor.packer)


def _is_frames(path: Path) -> bool:
    return _holds(path, "frames")


def _holds(path: Path, name: str) -> bool:
    """Whether a file is an archive with an array of that name."""
    if path.suffix.lower() != ".npz":
        return False
    with open_archive(path, "an array of numbers is needed") as archive:
        return name in archive


def _first_frame(path: Path) -> tuple[Floats, Ints]:
    with open_archive(path, "faces and key0 are needed") as archive:
        require_memory_for_frames(1, archive.headers(["key0"])["key0"].rows)
        first, faces = archive.read(("key0", "faces")).values()
    pair = KeyPair.checked(first, first, faces)
    return pair.key0, pair.faces


def _mappings(content: TetFile, target: Path | None) -> list[Mapping]:
    values = content.at_vertices.get(TARGET)
    if target is not None or values is None or values.ndim != 3:
        return [content.mapping(None if target is None else read_tets(target))]
    if not values.shape[1]:
        raise InputError(f"The array '{TARGET}' has no maps.")
    return [Mapping.checked(content.points, content.tets, frame) for frame in values.transpose(1, 0, 2)]


def _report(compressor: Compressor, choice: Choice, size: int) -> dict[str, Any]:
    """What was gained and what it cost, as plain values."""
    targets, codec = compressor.targets, compressor.codec
    raw = 4 * targets.size  # in single precision
    quantised = compressor.quantised_coordinates(max(choice.error, 1e-12))
    remainder = choice.compressed.remainder
    report: dict[str, Any] = {
        "bytes": size,
        "raw_bytes": raw,
        "quantised_bytes": len(quantised.data),
        "quantised_folds": quantised.folds,
        "ratio_to_raw": raw / size,
        "ratio_to_quantised": len(quantised.data) / size,
        "modes": choice.compressed.numbers.shape[1],
        "remainder": 0 if remainder is None else int(remainder.size),
        "error": choice.errors.tolist(),
        "mean_square_error": ((choice.errors * codec.diagonal) ** 2).tolist(),
        "folds": list(choice.folds),
    }
    if codec.observes_map:
        mesh = codec.mesh
        held = np.zeros(mesh.points.shape, dtype=bool)
        held[np.unique(mesh.boundary_faces)] = True
        held &= mesh.on_cube_face if codec.boundary == "sliding" else True
        report["boundary_error"] = [float(np.abs(missed[held]).max()) for missed in choice.restored - targets]
        report["transfer_error"] = [_transfer_error(codec, values) for values in targets]
    return report


def _transfer_error(codec: Codec, values: Floats) -> float | None:
    """The error of the transfer between tetrahedra and vertices alone; None where it leaves no map."""
    mesh = codec.mesh
    if codec.boundary == "sliding":
        conditions = Conditions.sliding_cube(mesh)
    else:
        conditions = Conditions.fixed_boundary(mesh, values)
    found = transferred(Mapping(mesh, values), codec.scheme, conditions)
    if found is None:
        return None
    return float(np.sqrt(((found.values - values) ** 2).sum(axis=1).mean()) / codec.diagonal)
