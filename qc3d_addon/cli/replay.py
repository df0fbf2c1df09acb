# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d replay``: the bake of a bug report again."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..solver.errors import InputError
from ..solver.files.atomic import replacing_all, require_writable
from ..solver.frames.bug_reports import read_bug_report
from ..solver.frames.files import write_frames
from ..solver.frames.task import carry_out
from ..solver.support.progress import finish
from . import speech
from .options import print_notes, write_json
from .progress_bars import StageBars


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("replay", help="the bake of a bug report again")
    command.add_argument("file", type=Path, metavar="REPORT.zip", help="what Save Report for a Bug wrote, with shapes")
    command.add_argument("--output", type=Path, metavar="FRAMES.npz", help="where the frames go; nowhere by default")
    command.add_argument("--report", type=Path, metavar="R.json", help="where the report of the bake goes")
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    files = [path for path in (arguments.output, arguments.report) if path is not None]
    require_writable(*files, inputs=[arguments.file])
    found = read_bug_report(arguments.file)
    speech.say(found.text.rstrip())
    if found.task is None:
        raise InputError(
            f"{arguments.file} has the settings but no shapes, so that there is nothing to bake; ask for a report with "
            "shapes."
        )
    with StageBars() as bars:
        bake = finish(carry_out(found.task), bars).bake
    assert bake is not None
    with replacing_all(*files) as places:
        for wanted, place in zip(files, places, strict=True):
            if wanted == arguments.output:
                write_frames(place, list(found.task.pairs.values()), bake.times, bake.frames)
            else:
                write_json(place, bake.report.as_json())
    seconds = sum(bake.report.seconds.values())
    speech.say(f"\n{len(bake.times)} shapes in {seconds:.1f} seconds, folds {sum(bake.report.folds.frames or [])}.")
    print_notes(bake.report.notes)
