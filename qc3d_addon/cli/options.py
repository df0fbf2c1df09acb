# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Options and checks that several commands have."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, get_args, get_type_hints

from ..solver.errors import on_one_line
from ..solver.settings import FitOptions, FrameOptions, Mirror, PlayOptions
from . import speech

MOST_FRAMES = 10_000
_HELP = {
    "mode": "how in-betweens are made",
    "easing": "how the speed of the motion changes",
    "weights": "how in-betweens are blended while they are played",
    "stretch": "how mode natural interpolates lengths",
    "engine": "method that fills the volume around the mesh with tetrahedra",
    "quality": "resolution of the volume around the mesh; exact: that of the mesh, with a map that meets both keys",
    "extra_turns": "full turns to add to parts that can turn freely, which two shapes alone cannot tell",
    "seed": "seed of the random samples of the engine delaunay",
    "sampling": "samples of the engine delaunay: graded, or those of the paper",
    "threshold": "for the paper's sampling: within so many radii of the surface samples are thinned",
    "sparsity": "for the paper's sampling: how fast samples become fewer away from the surface",
}
_NUMBERS = ("threshold", "sparsity")
_METAVARS = {"extra_turns": "TURNS", "seed": "S"}


def add_mirror(command: argparse.ArgumentParser) -> None:
    """Add the option --mirror."""
    command.add_argument(
        "--mirror",
        choices=get_args(Mirror),
        default="auto",
        help="axes to mirror across, if the mesh is only one half; auto: those where it is open on a plane through the "
        "origin (default: auto)",
    )


def add_options(command: argparse.ArgumentParser, *kinds: type[FitOptions | FrameOptions | PlayOptions]) -> None:
    """Add the solver's options: those of the fit, of the frames, or both."""
    for kind in kinds:
        defaults, types = kind(), get_type_hints(kind)
        for name in types:
            if name not in _HELP:
                continue
            default, choices = getattr(defaults, name), get_args(types[name])
            command.add_argument(
                f"--{name.replace('_', '-')}",
                default=default,
                help=f"{_HELP[name]} (default: {default})",
                **({"choices": choices} if choices else _number_of(name)),
            )


def _number_of(name: str) -> dict[str, Any]:
    return {"type": float, "metavar": "X"} if name in _NUMBERS else {"type": whole_number, "metavar": _METAVARS[name]}


def fit_options(arguments: argparse.Namespace) -> FitOptions:
    """The options of the fit that were chosen; the others stay at their defaults."""
    return FitOptions(**_chosen(arguments, FitOptions))


def frame_options(arguments: argparse.Namespace) -> FrameOptions:
    """The options of the frames that were chosen."""
    return FrameOptions(**{**_chosen(arguments, FrameOptions), "via_at": tuple(arguments.via_at)})


def _chosen(arguments: argparse.Namespace, kind: type[FitOptions | FrameOptions]) -> dict[str, Any]:
    return {name: getattr(arguments, name) for name in get_type_hints(kind) if hasattr(arguments, name)}


def add_keys(command: argparse.ArgumentParser, kind: str, output: str, contents: str) -> None:
    """Add the keys to go through, the number of in-betweens, and where results go."""
    add_way(command, kind)
    command.add_argument(
        "--frames", type=frame_count, required=True, metavar="N", help="number of in-betweens between every two"
    )
    add_outputs(command, output, contents)


def add_way(command: argparse.ArgumentParser, kind: str, is_required: bool = True) -> None:
    """Add the options for the keys that the motion goes through."""
    command.add_argument(
        "--from", dest="first", required=is_required, metavar="NAME", help=f"the {kind} to start from"
    )
    command.add_argument(
        "--via", action="append", default=[], metavar="NAME", help=f"a {kind} to go through; repeat for more, in order"
    )
    command.add_argument(
        "--via-at",
        type=float,
        nargs="+",
        default=(),
        metavar="T",
        help="when the motion is there, one number for each --via, from 0 (--from) to 1 (--to) (default: evenly)",
    )
    command.add_argument("--to", dest="last", required=is_required, metavar="NAME", help=f"the {kind} to end with")


def add_outputs(command: argparse.ArgumentParser, output: str, contents: str) -> None:
    """Add the options for the output and the report."""
    command.add_argument("--output", type=Path, required=True, metavar=output, help=contents)
    command.add_argument("--report", type=Path, metavar="REPORT.json", help="engine, folds, residual, seconds, memory")


def key_names(arguments: argparse.Namespace) -> tuple[str, ...]:
    """The keys of ``add_way`` from the first to the last."""
    return (arguments.first, *arguments.via, arguments.last)


def output_files(arguments: argparse.Namespace) -> list[Path]:
    """The output, and the report if one is asked for."""
    return [arguments.output, *([] if arguments.report is None else [arguments.report])]


def print_notes(notes: Iterable[str]) -> None:
    """Print sentences for the user on standard error."""
    for note in notes:
        speech.note(on_one_line(note))


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write a report; raises OSError if it cannot be written."""
    path.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def whole_number(text: str) -> int:
    """A whole number; for argparse."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None


def frame_count(text: str) -> int:
    """A number of in-betweens; for argparse."""
    count = whole_number(text)
    if not 0 <= count <= MOST_FRAMES:
        raise argparse.ArgumentTypeError(f"{text} in-betweens are not possible; 0 to {MOST_FRAMES} are")
    return count
