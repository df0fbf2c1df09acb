# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d interpolate``: in-betweens of shapes in an .npz file."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..solver.files.atomic import replacing_all, require_writable
from ..solver.files.npz import open_archive
from ..solver.frames.bake_settings import Settings
from ..solver.frames.files import write_frames
from ..solver.frames.key_times import KeyTimes
from ..solver.frames.modes import needs_fits
from ..solver.frames.task import Task, carry_out
from ..solver.keys.files import read_pairs
from ..solver.settings import FitOptions, FrameOptions
from ..solver.support.progress import finish
from .frame_files import collider_in
from .options import (
    add_keys,
    add_mirror,
    add_options,
    fit_options,
    frame_options,
    key_names,
    output_files,
    print_notes,
    write_json,
)
from .progress_bars import StageBars


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("interpolate", help="in-betweens of shapes in an .npz file")
    command.add_argument(
        "pair",
        type=Path,
        metavar="PAIR.npz",
        help="faces (m, 3), shape_names (k,), V0, V1, ... (n, 3), polygons (m,) where known; collider (k, c, 3), at "
        "each key or once, and collider_faces (f, 3), which the frames do not enter",
    )
    add_keys(command, "shape", "FRAMES.npz", "faces, frames, times, key0, key1, settings")
    add_mirror(command)
    add_options(command, FrameOptions, FitOptions)
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    files = output_files(arguments)
    require_writable(*files, inputs=[arguments.pair])
    names = key_names(arguments)
    fit, frame = fit_options(arguments), frame_options(arguments)
    times = KeyTimes.of(frame, len(names) - 1).between(arguments.frames)
    pairs = read_pairs(
        arguments.pair,
        names,
        frames=len(times),
        quality=fit.quality,
        needs_fits=needs_fits(frame.mode),
        mirror=arguments.mirror,
    )
    with open_archive(arguments.pair, "faces, shape_names and V0, V1, ... are needed") as archive:
        collider = collider_in(archive)
    task = Task(pairs, names, fit, frame, times, collider=None if collider is None else collider.at_keys(len(names)))
    with StageBars() as bars:
        bake = finish(carry_out(task), bars).bake
    assert bake is not None
    settings = Settings.of_task(task, bake.frames)
    with replacing_all(*files) as (output, *reports):
        text = "" if settings is None else settings.text
        write_frames(output, list(pairs.values()), bake.times, bake.frames, text, task.collider)
        for report in reports:
            write_json(report, bake.report.as_json())
    print_notes(bake.report.notes)
