# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``qc3d``: in-betweens without Blender's window."""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import NoReturn

from ..solver.errors import InputError, QC3DError
from . import analyze, bake, compress, interpolate, reconstruct, reproduce


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns
    -------
    0 when it is done; 2 when the input is not usable, with one sentence on standard error; 130 when interrupted.
    """
    try:
        arguments = _parser().parse_args(argv)
        arguments.run(arguments)
    except QC3DError as error:
        print(f"qc3d: {error}", file=sys.stderr)
        return 2
    except MemoryError:
        print("qc3d: There is not enough memory; use fewer frames, a lower quality or a smaller mesh.", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("qc3d: Interrupted; nothing was written.", file=sys.stderr)
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="qc3d", description="In-betweens between shapes of one mesh, through fold-free maps.")
    parser.add_argument("--version", action="version", version=f"qc3d {_version()}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    for command in (interpolate, bake, analyze, reconstruct, compress, reproduce):
        command.add_to(commands)
    return parser


def _version() -> str:
    """The version of the manifest that came with the code: inside the extension, above the package in a checkout."""
    package = Path(__file__).parent.parent
    for manifest in (package / "blender_manifest.toml", package.parent / "blender_manifest.toml"):
        if manifest.is_file():
            return str(tomllib.loads(manifest.read_text(encoding="utf-8"))["version"])
    return metadata.version("qc3d")


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one sentence; argparse alone would print the usage of the whole command before it."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message[:1].upper()}{message[1:]}; see {self.prog} --help.")
