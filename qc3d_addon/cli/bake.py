# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d bake``: in-between shape keys in a .blend file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..solver.errors import InputError
from ..solver.settings import FitOptions, FrameOptions, PlayOptions
from . import speech
from .options import (
    add_options,
    add_outputs,
    add_way,
    fit_options,
    frame_count,
    frame_options,
    key_names,
    print_notes,
    whole_number,
)
from .progress_bars import StageBars

if TYPE_CHECKING:
    import bpy

    from ..blender.bake.request import BakeRequest

_NO_KEYS = ("", "")  # each of many keys has its own


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("bake", help="in-between shape keys in a .blend file")
    command.add_argument("file", type=Path, metavar="FILE.blend", help="a file with a mesh that has two shape keys")
    objects = command.add_mutually_exclusive_group(required=True)
    objects.add_argument(
        "--object", dest="objects", action="append", default=[], metavar="NAME", help="a mesh object; once for each"
    )
    objects.add_argument("--all-objects", action="store_true", help="every mesh with two shape keys or more")
    add_way(command, "shape key", is_required=False)
    command.add_argument(
        "--on-key",
        dest="on_keys",
        action="append",
        default=[],
        metavar="KEY",
        help="a shape key whose own value is to play in-betweens from what it is relative to; once for each",
    )
    command.add_argument("--all-keys", action="store_true", help="the same for every shape key that needs it")
    amount = command.add_mutually_exclusive_group()
    amount.add_argument("--frames", type=frame_count, metavar="N", help="number of in-betweens between every two keys")
    amount.add_argument(
        "--tolerance", type=float, metavar="T", help="as few in-betweens as play the motion within this distance"
    )
    add_outputs(command, "OUT.blend", "the file with the in-betweens; may be the file itself")
    command.add_argument(
        "--keyframes",
        type=whole_number,
        nargs=2,
        metavar=("FIRST", "LAST"),
        help="animate what plays them over these frames",
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
        from ..blender.bake.run import bake_file, bake_object, bake_object_keys
    except ImportError as error:
        raise InputError(f"Blender's Python module does not load: {error}.") from error
    ways = [bool(arguments.on_keys), arguments.all_keys, any((arguments.first, arguments.last, arguments.via))]
    if sum(ways) != 1:
        raise InputError("Name the keys in one way: --from and --to, --on-key, or --all-keys; see qc3d bake --help.")
    request = _request(arguments, is_pair=ways[2])
    with StageBars() as bars:

        def bake_pair(obj: bpy.types.Object) -> tuple[list[str], Any]:
            result = bake_object(obj, request, bars)
            return list(result.notes), result.report

        def bake_keys(obj: bpy.types.Object) -> tuple[list[str], Any]:
            verdicts = bake_object_keys(obj, arguments.on_keys, request, bars)
            if all(verdict.ended == "failed" for verdict in verdicts):
                raise InputError(" ".join(map(str, verdicts)))
            values = [{"key": one.key, "ended": one.ended, "text": one.text, "report": one.report} for one in verdicts]
            return [f"{obj.name}: {verdict}" for verdict in verdicts], {"keys": values}

        work = bake_pair if ways[2] else bake_keys
        told = bake_file(arguments.file, arguments.objects, work, arguments.output, arguments.report)
    sentences = [sentence for of_object in told for sentence in of_object]
    if ways[2]:
        print_notes(sentences)
    else:
        for sentence in sentences:
            speech.say(sentence)


def _request(arguments: argparse.Namespace, is_pair: bool) -> BakeRequest:
    """What to bake; of many keys everything but these."""
    from ..blender.bake.request import BakeRequest

    if is_pair and not (arguments.first and arguments.last):
        raise InputError("The following arguments are required: --from, --to; see qc3d bake --help.")
    if not is_pair and (arguments.keyframes or arguments.play_on == "slider"):
        raise InputError("Keys that play in-betweens themselves take neither --keyframes nor --play-on slider.")
    if arguments.tolerance is not None and not arguments.tolerance > 0.0:
        raise InputError(f"The tolerance is {arguments.tolerance}; it must be a distance above 0.")
    count = {} if arguments.frames is None else {"count": arguments.frames}
    return BakeRequest(
        key_names(arguments) if is_pair else _NO_KEYS,
        fit_options=fit_options(arguments),
        frame_options=frame_options(arguments),
        keyframes=arguments.keyframes,
        tolerance=arguments.tolerance or 0.0,
        colliders=arguments.colliders,
        weights=arguments.weights,
        play_on=arguments.play_on,
        **count,
    )
