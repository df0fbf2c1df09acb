# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d combine``: the shape of several keys of an .npz file on at once, and what adding them would do."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import get_args

from ..solver.combinations.base import KeysOnBase
from ..solver.combinations.mirrored import combine_halves
from ..solver.combinations.verdicts import verdicts
from ..solver.errors import InputError
from ..solver.files.atomic import replacing_all, require_writable
from ..solver.files.npz import write_arrays
from ..solver.keys.files import read_shapes
from ..solver.settings import Between, FitOptions
from ..solver.support.progress import finish
from . import speech
from .options import add_mirror, add_options, fit_options, print_notes
from .progress_bars import StageBars


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("combine", help="the shape with several keys on at once")
    command.add_argument(
        "shapes", type=Path, metavar="SHAPES.npz", help="faces (m, 3), shape_names (k,), V0, V1, ... (n, 3)"
    )
    command.add_argument("--rest", required=True, metavar="NAME", help="the shape that the keys are relative to")
    command.add_argument("--outer", required=True, metavar="NAME", help="the key that carries the others along")
    command.add_argument(
        "--inner",
        required=True,
        action="append",
        metavar="NAME",
        help="a key inside the outer one; repeat for one inside that",
    )
    command.add_argument(
        "--weights", type=float, nargs="+", metavar="W", help="weight of each key, 0 to 1, in that order (default: 1)"
    )
    command.add_argument("--find-order", action="store_true", help="find the order of the keys instead, and print it")
    command.add_argument(
        "--between",
        choices=get_args(Between),
        default="auto",
        help="what a key with a weight between shows: its natural in-between; or, with auto, if it is the pose of one "
        "joint by linear blend skinning, the pose with the joint turned as far (default: auto)",
    )
    add_mirror(command)
    command.add_argument("--output", type=Path, required=True, metavar="OUT.npz", help="faces (m, 3), shape (n, 3)")
    add_options(command, FitOptions)
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    require_writable(arguments.output, inputs=[arguments.shapes])
    names = [arguments.outer, *arguments.inner]
    if len({arguments.rest, *names}) <= len(names):
        raise InputError("The rest shape and the keys must all be different; name each once.")
    options = fit_options(arguments)
    read = [arguments.rest, *names]
    shapes, faces, _ = read_shapes(arguments.shapes, read, pairs=len(names), quality=options.quality)
    keys = KeysOnBase(shapes[arguments.rest], [shapes[name] for name in names], faces)
    order = None if arguments.find_order else range(len(names))
    with StageBars() as bars:
        work = combine_halves(keys, arguments.mirror, arguments.weights, order, options, arguments.between)
        made = finish(work, bars)
    with replacing_all(arguments.output) as (output,):
        write_arrays(output, {"faces": keys.pairs[0].faces, "shape": made.shape})
    if arguments.find_order:
        speech.say("The outermost first: " + ", ".join(names[number] for number in made.order))
    for verdict in verdicts(keys):
        speech.say(f"{names[verdict.first]}, {names[verdict.second]}: {verdict.text}")
    print_notes(made.notes)
