# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d analyze``: the distortion of a map, in figures, arrays and pictures."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..solver.errors import InputError
from ..solver.files.atomic import making_folder, replacing_all, require_writable_in
from ..solver.files.npz import write_arrays
from ..solver.fit.fit_pair import fit_pair
from ..solver.frames.measures import VertexMeasures
from ..solver.keys.files import read_pair
from ..solver.maps.analysis import Analysis
from ..solver.maps.files import EIGEN_FORM, STRETCH, TARGET, TetFile, put_tets, read_tets
from ..solver.maps.mapping import Mapping
from ..solver.settings import FitOptions
from ..solver.support.progress import finish
from . import speech
from .options import add_options, fit_options, print_notes, write_json
from .progress_bars import StageBars

if TYPE_CHECKING:
    from ..solver.fit.fitted_map import FittedMap


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("analyze", help="distortion of the map between two shapes, or of a map of a mesh")
    command.add_argument(
        "input",
        type=Path,
        metavar="FILE",
        help="with --from and --to: shapes as for interpolate, whose map is fitted first; otherwise tetrahedra with "
        "the array 'target': .npz, .vtu, .vtk, .msh",
    )
    command.add_argument("--from", dest="first", metavar="NAME", help="the first of two shapes")
    command.add_argument("--to", dest="last", metavar="NAME", help="the second shape")
    command.add_argument("--target", type=Path, metavar="FILE", help="the same tetrahedra with mapped vertices")
    command.add_argument("--format", choices=("npz", "vtu", "vtk", "msh"), default="npz", help="of mapping.* (npz)")
    command.add_argument(
        "--up", choices=("x", "y", "z"), default="z", help="the axis that points up in pictures of shapes (z)"
    )
    command.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="made if it does not exist")
    add_options(command, FitOptions)
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    if find_spec("matplotlib") is None:
        raise InputError("The pictures need matplotlib, which is not installed; pip install 'qc3d[demo]'.")
    fitted = None
    names = [f"mapping.{arguments.format}", "histograms.png", "slices.png", "summary.json"]
    if (arguments.first is None) != (arguments.last is None):
        raise InputError("Two shapes are needed; give both --from and --to, or neither for a tetrahedral mesh.")
    if arguments.first is not None:
        if arguments.target is not None:
            raise InputError("--target is for tetrahedral meshes only; leave it out, or leave out --from and --to.")
        names += ["surface.npz", "surface.png"]
    require_writable_in(arguments.output, names, [arguments.input, arguments.target])
    if arguments.first is not None:
        options = fit_options(arguments)
        pair = read_pair(arguments.input, arguments.first, arguments.last, options.quality)
        with StageBars() as bars:
            fitted = finish(fit_pair(pair, options), bars)
        mapping = Mapping(fitted.mesh, fitted.mapped)
    else:
        content = read_tets(arguments.input)
        print_notes(content.notes)
        mapping = content.mapping(None if arguments.target is None else read_tets(arguments.target))
    analysis = Analysis(mapping)
    with making_folder(arguments.output):
        _write(analysis, fitted, [arguments.output / name for name in names], arguments.up)
    _say(analysis.summary(), arguments.output)


def _say(summary: dict[str, Any], folder: Path) -> None:
    ratio, dilatation = summary["volume_ratio"], summary["dilatation"]
    largest = "infinite" if dilatation["largest"] is None else f"{dilatation['largest']:.3g}"
    speech.say(
        f"{summary['tetrahedra']} tetrahedra, {summary['folds']} folds; volume ratio {ratio['smallest']:.3g} to "
        f"{ratio['largest']:.3g}, dilatation {dilatation['median']:.3g} in the middle and at most {largest}; {folder}"
    )


def _write(analysis: Analysis, fitted: FittedMap | None, paths: list[Path], up: str) -> None:
    from qc3d_paper.drawing.slices import save_histograms, save_slices
    from qc3d_paper.drawing.surfaces import save_distortion

    summary = analysis.summary()
    with replacing_all(*paths) as (mapping, histograms, slices, text, *surface):
        put_tets(mapping, _with_attributes(analysis), paths[0])
        save_histograms(analysis, histograms)
        save_slices(analysis, slices)
        if fitted is not None:
            pair = fitted.pair
            measures = VertexMeasures([fitted]).of(0, pair.key1, fitted.mapped)
            summary["surface"] = {
                "vertices": len(pair.key0),
                "landmark_residual": asdict(fitted.landmark_residual()),
                **{name: {"smallest": float(v.min()), "largest": float(v.max())} for name, v in measures.items()},
            }
            write_arrays(surface[0], {"faces": pair.faces, "key0": pair.key0, "key1": pair.key1, **measures})
            save_distortion(pair, measures, surface[1], up)
        write_json(text, summary)


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
