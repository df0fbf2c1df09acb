# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d bake``: in-between shape keys in a .blend file."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..solver.errors import InputError
from ..solver.settings import FitOptions, FrameOptions, PlayOptions
from .options import (
    add_keys,
    add_options,
    fit_options,
    frame_options,
    key_names,
    print_notes,
    whole_number,
)
from .progress_bars import StageBars


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("bake", help="in-between shape keys in a .blend file")
    command.add_argument("file", type=Path, metavar="FILE.blend", help="a file with a mesh that has two shape keys")
    command.add_argument("--object", required=True, metavar="NAME", help="the mesh object")
    add_keys(command, "shape key", "OUT.blend", "the file with the in-betweens; may be the file itself")
    command.add_argument(
        "--keyframes",
        type=whole_number,
        nargs=2,
        metavar=("FIRST", "LAST"),
        help="animate the slider over these frames",
    )
    command.add_argument(
        "--play-on",
        choices=("auto", "key", "slider"),
        default="auto",
        help="what plays them: the last key's own value, or a slider of their own (default: the key where it can be)",
    )
    command.add_argument(
        "--colliders", default="", metavar="COLLECTION", help="objects that the in-betweens must not touch"
    )
    add_options(command, FrameOptions, FitOptions, PlayOptions)
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    try:
        from ..blender.bake.request import BakeRequest
        from ..blender.bake.run import bake_file
    except ImportError as error:
        raise InputError(f"Blender's Python module does not load: {error}.") from error
    request = BakeRequest(
        key_names(arguments),
        arguments.frames,
        fit_options(arguments),
        frame_options(arguments),
        arguments.keyframes,
        colliders=arguments.colliders,
        weights=arguments.weights,
        play_on=arguments.play_on,
    )
    with StageBars() as bars:
        result = bake_file(arguments.file, arguments.object, request, arguments.output, arguments.report, bars)
    print_notes(result.notes)
