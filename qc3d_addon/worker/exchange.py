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
from ..solver.combinations.corrections import Corrected, Corrections
from ..solver.files.npz import write_arrays
from ..solver.frames.bake import Bake
from ..solver.frames.many import Run
from ..solver.frames.report import BakeReport
from ..solver.frames.task import Outcome, Task
from ..solver.keys.halves import MirrorPlane
from ..solver.keys.keypair import KeyPair
from ..solver.settings import FitOptions, FrameOptions, PlayOptions

Job = Task | Run | Corrections

_PAIR = ("key0", "key1", "faces", "edges", "polygons")
_OF_CORRECTIONS = ("base", "alone", "sculpted", "places", "values", "faces", "edges")
_TASK, _OUTCOME, _RUN, _CORRECTIONS = "task.json", "outcome.json", "run.json", "corrections.json"


def write_job(folder: Path, job: Job) -> None:
    """Write a job of any kind into an empty folder; ``read_job`` reads it."""
    if isinstance(job, Run):
        write_run(folder, job)
    elif isinstance(job, Corrections):
        write_corrections(folder, job)
    else:
        write_task(folder, job)


def read_job(folder: Path) -> Job:
    """Read the job that ``write_job`` wrote."""
    if (folder / _RUN).exists():
        return read_run(folder)
    return read_corrections(folder) if (folder / _CORRECTIONS).exists() else read_task(folder)


def write_run(folder: Path, run: Run) -> None:
    """Write a run into an empty folder; arrays that tasks have in common are written once."""
    first = None
    for number, task in enumerate(run.tasks):
        of_task = folder_of(folder, number)
        of_task.mkdir(mode=0o700)
        write_task(of_task, task, first)
        first = first or next(iter(task.pairs.values()))
    _write_json(folder / _RUN, {"tasks": len(run.tasks), "memory_mb": run.memory_mb})


def read_run(folder: Path) -> Run:
    """Read the run that ``write_run`` wrote."""
    header = _read_json(folder / _RUN)
    tasks: list[Task] = []
    for number in range(header["tasks"]):
        first = next(iter(tasks[0].pairs.values())) if tasks else None
        tasks.append(read_task(folder_of(folder, number), first))
    return Run(tuple(tasks), header["memory_mb"])


def folder_of(folder: Path, number: int) -> Path:
    """The folder of one of the tasks of a run."""
    return folder / f"task{number}"


def write_task(folder: Path, task: Task, like: KeyPair | None = None) -> None:
    """Write a task into an empty folder; ``read_task`` reads it. Arrays that are those of ``like`` are left out."""
    for number, (ends, pair) in enumerate(task.pairs.items()):
        arrays = {name: getattr(pair, name) for name in _PAIR}
        own = {name: array for name, array in arrays.items() if like is None or array is not getattr(like, name)}
        _write(folder / f"pair{number}.npz", **own)
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


def read_task(folder: Path, like: KeyPair | None = None) -> Task:
    """Read the task that ``write_task`` wrote, beside the same ``like``."""
    header = _read_json(folder / _TASK)
    planes = tuple(
        MirrorPlane(tuple(plane["normal"]), tuple(plane["direction"]), plane["offset"], plane["reach"])
        for plane in header["planes"]
    )
    pairs, kept = {}, {}
    for number, (first, second) in enumerate(header["ends"]):
        with np.load(folder / f"pair{number}.npz", allow_pickle=False) as stored:
            arrays = [stored[name] if name in stored.files else getattr(like, name) for name in _PAIR]
        pairs[first, second] = replace(KeyPair(*arrays), planes=planes)
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


def write_corrections(folder: Path, wanted: Corrections) -> None:
    """Write what is wanted of keys that are on at once into an empty folder; ``read_corrections`` reads it."""
    _write(folder / "keys.npz", **{name: getattr(wanted, name) for name in _OF_CORRECTIONS})
    header = {"find_order": wanted.find_order, "fit_options": asdict(wanted.fit_options)}
    _write_json(folder / _CORRECTIONS, header)


def read_corrections(folder: Path) -> Corrections:
    """Read what ``write_corrections`` wrote."""
    header = _read_json(folder / _CORRECTIONS)
    with np.load(folder / "keys.npz", allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in _OF_CORRECTIONS}
    return Corrections(**arrays, find_order=header["find_order"], fit_options=FitOptions(**header["fit_options"]))


def write_corrected(folder: Path, made: Corrected) -> None:
    """Write the shapes of keys that are on at once into the same folder."""
    _write(folder / "shapes.npz", shapes=made.shapes)
    header = {"order": list(made.order), "crossings": made.crossings, "off": made.off, "is_sculpted": made.is_sculpted}
    _write_json(folder / _OUTCOME, header)


def read_corrected(folder: Path, wanted: Corrections) -> Corrected:
    """Read the shapes that ``write_corrected`` wrote.

    Raises
    ------
    OSError, ValueError, KeyError
        If they are incomplete, or not what was wanted.
    """
    header = _read_json(folder / _OUTCOME)
    with np.load(folder / "shapes.npz", allow_pickle=False) as stored:
        shapes = stored["shapes"]
    if sorted(header["order"]) != list(range(len(wanted.alone))):
        raise ValueError("the order is not that of the keys")
    if shapes.shape != (len(wanted.places), *wanted.base.shape) or not np.isfinite(shapes).all():
        raise ValueError("the shapes are not those asked for")
    return Corrected(
        tuple(header["order"]), shapes, int(header["crossings"]), float(header["off"]), bool(header["is_sculpted"])
    )


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
