# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``qc3d``: in-betweens without Blender's window."""

from __future__ import annotations

import argparse
import json
import tomllib
from collections.abc import Iterable, Sequence
from importlib import metadata
from itertools import pairwise
from pathlib import Path
from typing import NoReturn

from ..solver.arrays import Floats
from ..solver.errors import InputError, QC3DError, naming_pair, on_one_line, reason, with_remedy
from ..solver.files.atomic import replacing_all, require_writable
from ..solver.files.npz import read_pairs, write_frames
from ..solver.frames.chain import Bake, Steps, chain_inbetweens, evenly_spaced, finish, prepare
from ..solver.frames.straight import straight_inbetweens
from ..solver.frames.task import Task
from ..solver.keys.keypair import KeyPair
from ..solver.settings import Settings
from ..solver.support.memory import machine_limit_mb
from . import analyze, compress, reconstruct, reproduce, speech
from .options import add_settings, settings_of, whole_number
from .progress_bars import StageBars

MOST_FRAMES = 10_000


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns
    -------
    0 when it is done; 2 when the input is not usable, with one sentence on standard error; 130 when interrupted.
    """
    problem = None
    try:
        arguments = _parser().parse_args(argv)
        arguments.run(arguments)
    except QC3DError as error:
        problem = str(error)
    except MemoryError:
        problem = "There is not enough memory; use fewer frames, a lower quality or a smaller mesh."
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        problem = on_one_line(f"The system refuses to go on: {with_remedy(error)}{where}.")
    except RuntimeError as error:
        if "start new thread" not in str(error):
            raise
        problem = "The system allows no more threads; close some programs, or raise the limit (ulimit -u)."
    except KeyboardInterrupt:
        speech.note("Interrupted; nothing was written.")
        return 130
    finally:
        speech.flush()  # the texts of --help and --version too
    unheard = speech.take_unheard()
    if problem is None and unheard is not None:
        problem = f"Standard output cannot be written: {reason(unheard)}; all files are complete."
    if problem is not None:
        speech.note(problem)
        return 2
    return 0


def _interpolate(arguments: argparse.Namespace) -> None:
    settings = settings_of(arguments)
    files = [arguments.output, *([] if arguments.report is None else [arguments.report])]
    require_writable(*files, inputs=[arguments.pair])
    names = _key_names(arguments)
    pairs = read_pairs(arguments.pair, names)
    times = evenly_spaced((arguments.frames + 1) * len(pairs) - 1)
    Task(dict(zip(pairwise(names), pairs, strict=True)), names, settings, times).require_memory(machine_limit_mb())
    with StageBars() as bars:
        bake = finish(_inbetweens(pairs, names, times, settings), bars)
    with replacing_all(*files) as (output, *reports):
        write_frames(output, pairs, bake.times, bake.frames)
        for report in reports:
            report.write_text(json.dumps(bake.report, indent=1) + "\n", encoding="utf-8")
    _print_notes(bake.report["notes"])


def _inbetweens(pairs: Sequence[KeyPair], names: Sequence[str], times: Floats, settings: Settings) -> Steps[Bake]:
    if settings.mode == "straight":
        return (yield from straight_inbetweens(pairs, times, settings))
    prepared = []
    for pair, ends in zip(pairs, pairwise(names), strict=True):
        with naming_pair(*ends, names):
            prepared.append((yield from prepare(pair, settings)))
    return (yield from chain_inbetweens(prepared, times, settings))


def _bake(arguments: argparse.Namespace) -> None:
    try:
        from ..blender.bake.request import BakeRequest
        from ..blender.bake.run import bake_file
    except ImportError as error:
        raise InputError(f"Blender's Python module does not load: {error}.") from error
    request = BakeRequest(
        _key_names(arguments),
        arguments.frames,
        settings_of(arguments),
        arguments.keyframes,
        colliders=arguments.colliders,
    )
    with StageBars() as bars:
        result = bake_file(arguments.file, arguments.object, request, arguments.output, arguments.report, bars)
    _print_notes(result.notes)


def _print_notes(notes: Iterable[str]) -> None:
    for note in notes:
        speech.note(on_one_line(note))


def _key_names(arguments: argparse.Namespace) -> tuple[str, ...]:
    return (arguments.first, *arguments.via, arguments.last)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="qc3d", description="In-betweens between shapes of one mesh, through fold-free maps.")
    parser.add_argument("--version", action="version", version=f"qc3d {_version()}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    interpolate = commands.add_parser("interpolate", help="in-betweens of shapes in an .npz file")
    interpolate.add_argument(
        "pair", type=Path, metavar="PAIR.npz", help="faces (m, 3), shape_names (k,), V0, V1, ... (n, 3)"
    )
    _add_keys(interpolate, "shape", "FRAMES.npz", "faces, frames, times, key0, key1")
    add_settings(interpolate)
    interpolate.set_defaults(run=_interpolate)

    bake = commands.add_parser("bake", help="in-between shape keys in a .blend file")
    bake.add_argument("file", type=Path, metavar="FILE.blend", help="a file with a mesh that has two shape keys")
    bake.add_argument("--object", required=True, metavar="NAME", help="the mesh object")
    _add_keys(bake, "shape key", "OUT.blend", "the file with the in-betweens; may be the file itself")
    bake.add_argument(
        "--keyframes",
        type=whole_number,
        nargs=2,
        metavar=("FIRST", "LAST"),
        help="animate the slider over these frames",
    )
    bake.add_argument(
        "--colliders", default="", metavar="COLLECTION", help="objects that the in-betweens must not touch"
    )
    add_settings(bake)
    bake.set_defaults(run=_bake)

    for command in (analyze, reconstruct, compress, reproduce):
        command.add_to(commands)
    return parser


def _add_keys(command: argparse.ArgumentParser, kind: str, output: str, contents: str) -> None:
    command.add_argument("--from", dest="first", required=True, metavar="NAME", help=f"the {kind} to start from")
    command.add_argument(
        "--via", action="append", default=[], metavar="NAME", help=f"a {kind} to go through; once for each, in order"
    )
    command.add_argument("--to", dest="last", required=True, metavar="NAME", help=f"the {kind} to end with")
    command.add_argument(
        "--frames", type=_frame_count, required=True, metavar="N", help="number of in-betweens between every two"
    )
    command.add_argument("--output", type=Path, required=True, metavar=output, help=contents)
    command.add_argument("--report", type=Path, metavar="REPORT.json", help="engine, folds, residual, seconds, memory")


def _frame_count(text: str) -> int:
    count = whole_number(text)
    if not 0 <= count <= MOST_FRAMES:
        raise argparse.ArgumentTypeError(f"{text} in-betweens are not possible; 0 to {MOST_FRAMES} are")
    return count


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
