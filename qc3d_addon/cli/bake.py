# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d bake``: in-between shape keys in a .blend file."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
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
        "--object", dest="objects", action="append", default=[], metavar="NAME", help="a mesh object; repeat for more"
    )
    objects.add_argument("--all-objects", action="store_true", help="all meshes with two or more shape keys")
    command.add_argument(
        "--together",
        action="store_true",
        help="bake the objects in one map, so that what coincides stays together; the first one's control drives all",
    )
    add_way(command, "shape key", is_required=False)
    command.add_argument(
        "--on-key",
        dest="on_keys",
        action="append",
        default=[],
        metavar="KEY",
        help="a shape key whose own value will play in-betweens, from the key that it is relative to; repeat for more",
    )
    command.add_argument(
        "--combine",
        nargs="+",
        action="append",
        default=[],
        metavar="KEY",
        help="two shape keys or three that are on at once, to be corrected; once for each, after everything else",
    )
    command.add_argument("--all-keys", action="store_true", help="like --on-key for all shape keys that need it")
    amount = command.add_mutually_exclusive_group()
    amount.add_argument(
        "--frames",
        type=frame_count,
        metavar="N",
        help="number of in-betweens between every two keys (default: 5, or more where volumes would not be kept)",
    )
    amount.add_argument(
        "--tolerance", type=float, metavar="T", help="as few in-betweens as keep the motion within this distance"
    )
    add_outputs(command, "OUT.blend", "the file with the in-betweens; may be the input file")
    command.add_argument(
        "--keyframes",
        type=whole_number,
        nargs="+",
        metavar="FRAME",
        help="animate the key or slider that plays the in-betweens: the first and the last frame, or one for each key",
    )
    command.add_argument(
        "--play-on",
        choices=("auto", "key", "slider"),
        default="auto",
        help="what plays the in-betweens: the last key's own value or a separate slider (default: the key if possible)",
    )
    command.add_argument(
        "--colliders", default="", metavar="COLLECTION", help="objects that the in-betweens must not enter"
    )
    add_options(command, FrameOptions, FitOptions, PlayOptions)
    command.set_defaults(run=_run, check=check)


def check(arguments: argparse.Namespace) -> None:
    """Raise InputError if the options do not go together; nothing is read for that."""
    ways = [bool(arguments.on_keys), arguments.all_keys, _is_pair(arguments)]
    if sum(ways) > 1 or not (sum(ways) or arguments.combine):
        raise InputError(
            "Name the keys in one way: --from and --to, --on-key, --all-keys, or --combine alone; see qc3d bake --help."
        )
    if arguments.together and not (ways[2] and not arguments.combine):
        raise InputError("Objects are baked together from one key to another: name these by --from and --to.")
    if ways[2] and not (arguments.first and arguments.last):
        raise InputError("The following arguments are required: --from, --to; see qc3d bake --help.")
    if not ways[2] and (arguments.keyframes or arguments.play_on == "slider"):
        raise InputError("Keys that play in-betweens themselves take neither --keyframes nor --play-on slider.")
    if arguments.tolerance is not None and not arguments.tolerance > 0.0:
        raise InputError(f"The tolerance is {arguments.tolerance}; it must be a distance above 0.")


def _is_pair(arguments: argparse.Namespace) -> bool:
    return any((arguments.first, arguments.last, arguments.via))


def _run(arguments: argparse.Namespace) -> None:
    try:
        from ..blender.bake.run import bake_file, bake_object, bake_object_keys, bake_objects_together
        from ..blender.combinations.combine import combine
    except ImportError as error:
        raise InputError(f"Blender's Python module does not load: {error}.") from error
    check(arguments)
    is_pair = _is_pair(arguments)
    has_way = is_pair or arguments.all_keys or bool(arguments.on_keys)
    request = _request(arguments, is_pair)
    with StageBars() as bars:

        def bake_pair(obj: bpy.types.Object) -> tuple[list[str], Any]:
            result = bake_object(obj, request, bars)
            return list(result.notes), result.report

        def bake_keys(obj: bpy.types.Object) -> tuple[list[str], Any]:
            verdicts = bake_object_keys(obj, arguments.on_keys, request, bars.of_keys)
            if all(verdict.ended == "failed" for verdict in verdicts):
                raise InputError(" ".join(map(str, verdicts)))
            values = [{"key": one.key, "ended": one.ended, "text": one.text, "report": one.report} for one in verdicts]
            return [f"{obj.name}: {verdict}" for verdict in verdicts], {"keys": values}

        def combine_keys(obj: bpy.types.Object) -> tuple[list[str], Any]:
            said, values = (bake_pair if is_pair else bake_keys)(obj) if has_way else ([], {})
            for names in arguments.combine:
                made = combine(obj, names, options=fit_options(arguments), on_progress=bars)
                said.append(f"{obj.name}: {made.text}")
                values = {**values, "combinations": [*values.get("combinations", []), asdict(made)]}
            return said, values

        def bake_one_by_one(objects: Sequence[bpy.types.Object]) -> list[tuple[list[str], Any]]:
            one = combine_keys if arguments.combine else bake_pair if is_pair else bake_keys
            return [one(obj) for obj in objects]

        def bake_together(objects: Sequence[bpy.types.Object]) -> list[tuple[list[str], Any]]:
            results = bake_objects_together(objects, request, on_progress=bars)
            return [(list(result.notes), result.report) for result in results]

        work = bake_together if arguments.together else bake_one_by_one
        told = bake_file(arguments.file, arguments.objects, work, arguments.output, arguments.report)
    sentences = [sentence for of_object in told for sentence in of_object]
    if is_pair:
        print_notes(dict.fromkeys(sentences))
    else:
        for sentence in sentences:
            speech.say(sentence)


def _request(arguments: argparse.Namespace, is_pair: bool) -> BakeRequest:
    """What to bake; of many keys everything but these."""
    from ..blender.bake.request import BakeRequest

    count = {"more": True} if arguments.frames is None else {"count": arguments.frames}
    return BakeRequest(
        key_names(arguments) if is_pair else _NO_KEYS,
        fit_options=fit_options(arguments),
        frame_options=frame_options(arguments),
        keyframes=tuple(arguments.keyframes) if arguments.keyframes else None,
        tolerance=arguments.tolerance or 0.0,
        colliders=arguments.colliders,
        weights=arguments.weights,
        play_on=arguments.play_on,
        **count,
    )
