# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A task and its outcome as files in a folder: arrays as .npy and .npz without pickles, plain values as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..solver.collision.colliders import Collider
from ..solver.files.npz import write_arrays
from ..solver.frames.bake import Bake
from ..solver.frames.report import BakeReport
from ..solver.frames.task import Outcome, Task
from ..solver.keys.halves import MirrorPlane
from ..solver.keys.keypair import KeyPair
from ..solver.settings import FitOptions, FrameOptions, PlayOptions

_PAIR = ("key0", "key1", "faces", "edges", "polygons")
_TASK, _OUTCOME = "task.json", "outcome.json"


def write_task(folder: Path, task: Task) -> None:
    """Write a task into an empty folder; ``read_task`` reads it."""
    for number, (ends, pair) in enumerate(task.pairs.items()):
        _write(folder / f"pair{number}.npz", **{name: getattr(pair, name) for name in _PAIR})
        if ends in task.kept:
            (folder / f"kept{number}.map").write_bytes(task.kept[ends])
    np.save(folder / "times.npy", task.times, allow_pickle=False)
    if task.collider is not None:
        _write(folder / "collider.npz", shapes=task.collider.shapes, faces=task.collider.faces)
    header = {
        "ends": list(task.pairs),
        "through": task.through,
        "planes": [asdict(plane) for plane in next(iter(task.pairs.values())).planes],
        "fit_options": asdict(task.fit_options),
        "frame_options": asdict(task.frame_options),
        "play": None if task.play is None else asdict(task.play),
    }
    _write_json(folder / _TASK, header)


def read_task(folder: Path) -> Task:
    """Read the task that ``write_task`` wrote."""
    header = _read_json(folder / _TASK)
    planes = tuple(
        MirrorPlane(tuple(plane["normal"]), tuple(plane["direction"]), plane["offset"], plane["reach"])
        for plane in header["planes"]
    )
    pairs, kept = {}, {}
    for number, (first, second) in enumerate(header["ends"]):
        with np.load(folder / f"pair{number}.npz", allow_pickle=False) as stored:
            pairs[first, second] = replace(KeyPair(*(stored[name] for name in _PAIR)), planes=planes)
        path = folder / f"kept{number}.map"
        if path.exists():
            kept[first, second] = path.read_bytes()
    times = np.load(folder / "times.npy", allow_pickle=False)
    collider = None
    if (folder / "collider.npz").exists():
        with np.load(folder / "collider.npz", allow_pickle=False) as stored:
            collider = Collider(stored["shapes"], stored["faces"])
    frame_options = header["frame_options"]
    frame_options = FrameOptions(**{**frame_options, "via_at": tuple(frame_options["via_at"])})
    options = FitOptions(**header["fit_options"]), frame_options
    play = header["play"]
    if play is not None:
        play = PlayOptions(**{**play, "also_at": tuple(play["also_at"])})
    return Task(pairs, tuple(header["through"]), *options, times, kept, collider, play)


def write_outcome(folder: Path, outcome: Outcome) -> None:
    """Write the outcome of a task into the same folder."""
    for number, data in enumerate(outcome.fits.values()):
        (folder / f"made{number}.map").write_bytes(data)
    report = None
    if outcome.bake is not None:
        arrays: dict[str, Any] = {"times": outcome.bake.times, "frames": outcome.bake.frames}
        arrays |= {f"measure {name}": values for name, values in outcome.bake.measures.items()}
        _write(folder / "bake.npz", **arrays)
        report = outcome.bake.report.as_json()
    _write_json(folder / _OUTCOME, {"ends": list(outcome.fits), "report": report})


def read_outcome(folder: Path, task: Task) -> Outcome:
    """Read the outcome that ``write_outcome`` wrote.

    Raises
    ------
    OSError, ValueError, KeyError
        If it is incomplete, or not what the task asked for.
    """
    header = _read_json(folder / _OUTCOME)
    maps = {
        (first, second): (folder / f"made{number}.map").read_bytes()
        for number, (first, second) in enumerate(header["ends"])
    }
    if maps.keys() != (task.pairs.keys() if task.needs_fits else set()):
        raise ValueError("the maps belong to other keys")
    if not task.frame_count:
        return Outcome(maps, None)
    with np.load(folder / "bake.npz", allow_pickle=False) as stored:
        times, frames = stored["times"], stored["frames"]
        measures = {name.removeprefix("measure "): stored[name] for name in stored.files if name.startswith("measure ")}
    vertices = len(next(iter(task.pairs.values())).own.key0)
    known = task.times if task.moments is None else task.moments.times
    is_whole = np.array_equal(times, known) if task.play is None else np.isin(times, known).all() and len(times) > 1
    if not is_whole or frames.shape != (len(times), vertices, 3):
        raise ValueError("the frames are not those asked for")
    if not np.isfinite(frames).all():
        raise ValueError("a frame has positions that are not finite")
    return Outcome(maps, Bake(times, frames, BakeReport.from_json(header["report"]), measures))


def _write(path: Path, **arrays: NDArray[Any]) -> None:
    write_arrays(path, arrays, is_compressed=False)


def _write_json(path: Path, values: dict[str, Any]) -> None:
    path.write_text(json.dumps(values), encoding="utf-8")


def _read_json(path: Path) -> dict[str, Any]:
    values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return values
