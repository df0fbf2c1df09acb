# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d export``: an object of a .blend file with its in-betweens, for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..solver.errors import InputError
from ..solver.files.atomic import require_writable
from .options import print_notes, whole_number


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("export", help="an object with its in-betweens, for other programs")
    command.add_argument("file", type=Path, metavar="FILE.blend", help="a file with baked in-betweens")
    command.add_argument("--object", required=True, metavar="NAME", help="the mesh object")
    command.add_argument(
        "--shapes", type=whole_number, metavar="N", help="in-betweens of each key in USD and FBX (default: 12)"
    )
    command.add_argument(
        "--output", type=Path, required=True, metavar="OUT", help="its ending says the format: .usda, .usdc, .fbx, .glb"
    )
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    try:
        from ..blender.bake.run import opened_object
        from ..blender.exports.export import DENSITY, export
    except ImportError as error:
        raise InputError(f"Blender's Python module does not load: {error}.") from error
    shapes = DENSITY if arguments.shapes is None else arguments.shapes
    if not 1 <= shapes <= 99:
        raise InputError(f"{shapes} in-betweens of each key are not possible; choose 1 to 99.")
    require_writable(arguments.output, inputs=[arguments.file])
    print_notes(export(opened_object(arguments.file, arguments.object), arguments.output, shapes))
