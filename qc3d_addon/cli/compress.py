# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d compress``: maps and frames as small files."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, cast, get_args

import numpy as np

from ..solver.arrays import Floats
from ..solver.compression import frames as frame_compression
from ..solver.compression.codec import Codec
from ..solver.compression.compressed import Boundary, Scheme
from ..solver.compression.fields import Space
from ..solver.compression.files import Packer, Source
from ..solver.compression.pack import (
    ChosenBoundary,
    OfError,
    Small,
    diagonal_of,
    of_size,
    quantized_size,
    small_frames,
    small_maps,
    without_folds,
)
from ..solver.compression.search import Choice, Compressor
from ..solver.compression.transfer_loss import transferred
from ..solver.errors import InputError
from ..solver.files.atomic import replacing_all, require_writable
from ..solver.frames.remade import small_bake
from ..solver.maps.boundary_conditions import Conditions
from ..solver.maps.files import TARGET, TetFile, read_tets
from ..solver.maps.mapping import Mapping
from ..solver.support.memory import compression_mb, require_memory_for_compression
from ..solver.support.progress import Progress, finish
from ..solver.tets.mesh import TetMesh
from . import speech
from .frame_files import FrameFile, holds, read_frame_file
from .options import output_files, print_notes, whole_number, write_json
from .progress_bars import StageBars

_MODES = 300
_SMALLEST, _STORED = "smallest", "stored"
# Of the boundary of the schemes that have names, where no error is asked for.
_BOUNDARY_STEP = 1e-4


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    compress = commands.add_parser("compress", help="a map, or the frames of a chain, as a small file")
    compress.add_argument(
        "map",
        type=Path,
        metavar="FILE",
        help="tetrahedra with the array 'target' (N, 3), or (N, k, 3) for k maps; or FRAMES.npz of interpolate",
    )
    compress.add_argument("--target", type=Path, metavar="FILE", help="the same tetrahedra with their vertices mapped")
    compress.add_argument("--output", type=Path, required=True, metavar="FILE.qc3d")
    compress.add_argument(
        "--scheme",
        choices=(_SMALLEST, _STORED, *get_args(Scheme)),
        help="smallest: of all that QC3D knows; stored: the same, but frames are never baked again by the reader; the "
        "others: modes of the representation (default: smallest; with --modes, fitted)",
    )
    compress.add_argument(
        "--boundary",
        choices=get_args(ChosenBoundary),
        default="auto",
        help="of maps. sliding: the faces of the cube stay in themselves; fixed: as near as all else; exact: bit for "
        "bit (default: auto, sliding where the maps allow it, otherwise fixed)",
    )
    amount = compress.add_mutually_exclusive_group(required=True)
    amount.add_argument("--modes", type=whole_number, metavar="K", help="the lowest K modes and nothing else")
    amount.add_argument(
        "--error", type=float, metavar="E", help="root mean square error allowed, over the bounding box's diagonal"
    )
    amount.add_argument("--size", type=whole_number, metavar="BYTES", help="of the file")
    compress.add_argument(
        "--no-folds", action="store_true", help="with --error, of maps: nearer, where folds would come back otherwise"
    )
    compress.add_argument("--report", type=Path, metavar="REPORT.json", help="sizes, ratios, errors, folds")
    compress.set_defaults(run=_compress)


class _Result(NamedTuple):
    data: bytes
    report: dict[str, Any]
    error: float
    folds: int
    way: str


def _compress(arguments: argparse.Namespace) -> None:
    if arguments.error is not None and not 0.0 < arguments.error < np.inf:
        raise InputError(f"The error {arguments.error} is not possible; give a number above 0.")
    files = output_files(arguments)
    require_writable(*files, inputs=[arguments.map, arguments.target])
    scheme = arguments.scheme or (_SMALLEST if arguments.modes is None else "fitted")
    if scheme in (_SMALLEST, _STORED) and arguments.modes is not None:
        raise InputError(f"The scheme {scheme} chooses its modes itself; give an error or a size, or another scheme.")
    if arguments.no_folds and (scheme not in (_SMALLEST, _STORED) or arguments.error is None):
        raise InputError("--no-folds belongs to --error and the schemes smallest and stored; leave it out.")
    is_frames = holds(arguments.map, "frames")
    if is_frames and (arguments.target is not None or arguments.boundary != "auto" or arguments.no_folds):
        raise InputError("Frames have no target, no boundary and no folds to avoid; leave those options out.")
    if is_frames and scheme in ("published", "logarithm"):
        raise InputError("Frames are compressed by the schemes smallest, stored and fitted; leave that option out.")
    with StageBars() as bars:

        def progress(share: float) -> None:
            bars(Progress("compress", share))

        if scheme in (_SMALLEST, _STORED):
            result = _small(arguments, scheme, is_frames, progress)
        else:
            result = _named(arguments, cast(Scheme, scheme), is_frames, progress)
    with replacing_all(*files) as (output, *report_files):
        output.write_bytes(result.data)
        for report_file in report_files:
            write_json(report_file, result.report)
    report = result.report
    speech.say(
        f"{len(result.data)} bytes ({result.way}), 1 : {report['ratio_to_raw']:.0f} of raw coordinates, 1 : "
        f"{report['ratio_to_quantized']:.2f} of quantized ones at the same error; error {result.error:.2g}, folds "
        f"{result.folds}"
    )
    own_folds = sum(report.get("own_folds", ()))
    if own_folds:
        print_notes([f"{own_folds} tetrahedra of the maps are folded themselves, {result.folds} come back folded."])
    elif result.folds and arguments.error is not None and not is_frames:
        print_notes([f"{result.folds} tetrahedra come back folded; a smaller error or --no-folds avoids that."])


def _small(arguments: argparse.Namespace, scheme: str, is_frames: bool, progress: Callable[[float], object]) -> _Result:
    """The smallest file by whichever way."""
    mesh: TetMesh | None = None
    if is_frames:
        file = read_frame_file(arguments.map)
        _announce(file.frames.shape[1], len(file.frames), Space(file.frames[0], file.faces))
        pack, points, targets = _of_frames(file, scheme), file.frames[0], file.frames[1:]
    else:
        mesh, targets = _read_maps(arguments)
        _announce(len(mesh.points), len(targets), Space(mesh.points, mesh.tets))
        pack, points = _of_maps(mesh, targets, arguments.boundary), mesh.points
    if arguments.size is not None:
        work = of_size(pack, arguments.size)
    else:
        work = without_folds(pack, arguments.error) if arguments.no_folds else pack(arguments.error)
    small = finish(work, progress)
    return _Result(small.data, _small_report(small, points, targets, mesh), small.error, sum(small.folds), small.way)


def _announce(vertices: int, count: int, space: Space) -> None:
    """Refuse what does not fit into memory, and say how much the rest will take."""
    about = (vertices, count, space.most_modes, space.is_surface)
    require_memory_for_compression(*about)
    speech.say(f"needs about {compression_mb(*about):.0f} MB of memory")


def _of_frames(file: FrameFile, scheme: str) -> OfError:
    settings = file.settings
    if scheme == _STORED or settings is None:
        return lambda error: small_frames(file.frames, file.faces, error)
    return lambda error: small_bake(file.frames, file.faces, error, settings, file.polygons, file.collider)


def _of_maps(mesh: TetMesh, targets: Floats, boundary: ChosenBoundary) -> OfError:
    return lambda error: small_maps(mesh, targets, error, boundary)


def _small_report(small: Small, points: Floats, targets: Floats, mesh: TetMesh | None) -> dict[str, Any]:
    raw, unit = 4 * targets.size, diagonal_of(points)
    quantized = quantized_size(targets - points, unit, max(small.error, 1e-12))
    report: dict[str, Any] = {
        "bytes": len(small.data),
        "raw_bytes": raw,
        "quantized_bytes": quantized,
        "ratio_to_raw": raw / len(small.data),
        "ratio_to_quantized": quantized / len(small.data),
        "way": small.way,
        "error": small.errors.tolist(),
        "mean_square_error": ((small.errors * unit) ** 2).tolist(),
        "folds": list(small.folds),
    }
    if mesh is not None:
        report["unfolded"] = small.is_unfolded
        report["own_folds"] = [Mapping(mesh, values).folds for values in targets]
        boundary = np.unique(mesh.boundary_faces)
        report["boundary_error"] = np.abs(small.restored - targets)[:, boundary].max(axis=(1, 2)).tolist()
    return report


def _named(
    arguments: argparse.Namespace, scheme: Scheme, is_frames: bool, progress: Callable[[float], object]
) -> _Result:
    """The modes of the representation, by a scheme that has a name."""
    compressor = _frames_compressor(arguments) if is_frames else _maps_compressor(arguments, scheme)
    compressor.progress = progress
    if arguments.modes is not None:
        choice = compressor.with_modes(compressor.codec.modes)
    elif arguments.error is not None:
        choice = compressor.with_error(arguments.error)
    else:
        choice = compressor.with_size(arguments.size)
    data = compressor.packer.bytes_of(choice.compressed)
    return _Result(data, _report(compressor, choice, len(data)), choice.error, sum(choice.folds), scheme)


def _maps_compressor(arguments: argparse.Namespace, scheme: Scheme) -> Compressor:
    mesh, targets = _read_maps(arguments)
    stays = bool((targets == mesh.points)[:, mesh.on_cube_face].all() and mesh.on_cube_face.any())
    boundary: Boundary = (
        "sliding" if arguments.boundary == "sliding" or (arguments.boundary == "auto" and stays) else "fixed"
    )
    step = 0.0
    if arguments.boundary != "exact":
        step = float(np.float32(diagonal_of(mesh.points) * (arguments.error or _BOUNDARY_STEP)))
    modes = min(_MODES if arguments.modes is None else arguments.modes, len(np.unique(mesh.tets)) - 2)
    codec = Codec(mesh, modes, scheme, boundary, held_step=step)
    return Compressor(codec, targets, Packer(Source("maps", mesh.points, mesh.tets), modes))


def _frames_compressor(arguments: argparse.Namespace) -> Compressor:
    file = read_frame_file(arguments.map)
    modes = min(frame_compression.MOST_MODES if arguments.modes is None else arguments.modes, _MODES)
    return frame_compression.compressor(file.frames, file.faces, modes)


def _read_maps(arguments: argparse.Namespace) -> tuple[TetMesh, Floats]:
    """The mesh, and its maps (F, N, 3)."""
    content = read_tets(arguments.map)
    print_notes(content.notes)
    mappings = _mappings(content, arguments.target)
    return mappings[0].mesh, np.stack([mapping.values for mapping in mappings])


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
    quantized = compressor.quantized_coordinates(max(choice.error, 1e-12))
    remainder = choice.compressed.remainder
    report: dict[str, Any] = {
        "bytes": size,
        "raw_bytes": raw,
        "quantized_bytes": len(quantized.data),
        "quantized_folds": quantized.folds,
        "ratio_to_raw": raw / size,
        "ratio_to_quantized": len(quantized.data) / size,
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
