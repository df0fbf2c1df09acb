# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d analyze``: how much a mapping distorts, in figures, arrays and pictures."""

from __future__ import annotations

import argparse
import json
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..progress_bars import StageBars
from ..solver.analysis import Analysis
from ..solver.array_files import read_pairs, replacing
from ..solver.errors import InputError
from ..solver.mapping import Mapping
from ..solver.mapping_files import EIGEN_FORM, STRETCH, TARGET, TetFile, read_tets, write_tets
from ..solver.measures import VertexMeasures
from ..solver.pipeline import finish, prepare
from .options import add_settings, settings_of

if TYPE_CHECKING:
    from ..solver.prepared import PreparedMap


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("analyze", help="how much the map between two shapes, or of a mesh, distorts")
    command.add_argument(
        "input",
        type=Path,
        metavar="FILE",
        help="with --from and --to: shapes as for interpolate, whose map is fitted first; else tetrahedra with the "
        "array 'target': .npz, .vtu, .vtk, .msh",
    )
    command.add_argument("--from", dest="first", metavar="NAME", help="the first of two shapes")
    command.add_argument("--to", dest="last", metavar="NAME", help="the second")
    command.add_argument("--target", type=Path, metavar="FILE", help="the same tetrahedra with their vertices mapped")
    command.add_argument("--format", choices=("npz", "vtu", "vtk", "msh"), default="npz", help="of mapping.* (npz)")
    command.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="made where it is not there")
    add_settings(command, frames=False)
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    if find_spec("matplotlib") is None:
        raise InputError("The pictures need matplotlib, which is not installed; pip install 'qc3d[demo]'.")
    prepared = None
    if (arguments.first is None) != (arguments.last is None):
        raise InputError("Two shapes are needed; give both --from and --to, or neither for a mesh of tetrahedra.")
    if arguments.first is not None:
        if arguments.target is not None:
            raise InputError("--target belongs to meshes of tetrahedra; leave it out, or --from and --to.")
        pair = read_pairs(arguments.input, (arguments.first, arguments.last))[0]
        with StageBars() as bars:
            prepared = finish(prepare(pair, settings_of(arguments)), bars)
        mapping = Mapping(prepared.mesh, prepared.mapped)
    else:
        mapping = read_tets(arguments.input).mapping(None if arguments.target is None else read_tets(arguments.target))
    analysis = Analysis(mapping)
    try:
        arguments.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{arguments.output} cannot be made a folder: {error.strerror or error}.") from error
    _write(analysis, prepared, arguments.output, arguments.format)


def _write(analysis: Analysis, prepared: PreparedMap | None, folder: Path, ending: str) -> None:
    from ..figures.slices import save_histograms, save_slices
    from ..figures.surfaces import save_distortion

    summary = analysis.summary()
    write_tets(folder / f"mapping.{ending}", _with_attributes(analysis))
    if prepared is not None:
        measures = VertexMeasures([prepared]).of(0, prepared.pair.key1, prepared.mapped)
        summary["surface"] = {
            "vertices": len(prepared.pair.key0),
            "landmark_residual": prepared.landmark_residual(),
            **{name: {"smallest": float(v.min()), "largest": float(v.max())} for name, v in measures.items()},
        }
        with replacing(folder / "surface.npz") as unfinished, unfinished.open("wb") as file:
            arrays: dict[str, Any] = dict(measures)
            pair = prepared.pair
            np.savez_compressed(file, faces=pair.faces, key0=pair.key0, key1=pair.key1, **arrays)
        with replacing(folder / "surface.png") as unfinished:
            save_distortion(prepared.pair, measures, unfinished)
    with replacing(folder / "histograms.png") as unfinished:
        save_histograms(analysis, unfinished)
    with replacing(folder / "slices.png") as unfinished:
        save_slices(analysis, unfinished)
    with replacing(folder / "summary.json") as unfinished:
        unfinished.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")


def _with_attributes(analysis: Analysis) -> TetFile:
    mapping = analysis.mapping
    return TetFile(
        mapping.mesh.points,
        mapping.mesh.tets,
        {TARGET: mapping.values, **{f"{name}_at_vertices": v for name, v in analysis.at_vertices().items()}},
        {
            STRETCH: analysis.upper_triangle,
            EIGEN_FORM: analysis.eigen_form,
            "directions": analysis.directions.reshape(-1, 9),
            **analysis.measures,
        },
    )
