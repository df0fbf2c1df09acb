# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d batch``: many jobs of one file, resumed where they were stopped."""

from __future__ import annotations

import argparse
import json
import time as clock
import uuid
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, get_args

from ...solver.errors import InputError, on_one_line
from ...solver.files.atomic import making_folder, replacing, require_writable
from ...solver.support.memory import machine_limit_mb
from ...solver.support.threads import cores
from .. import speech
from ..options import whole_number
from ..version import version
from . import child
from .job import Job
from .jobs import read_jobs
from .orders import Ended, HowEnded, Order
from .pools import Cluster, Pool, Processes
from .records import State
from .schedule import Schedule

STATUS_FAILED, STATUS_INTERRUPTED = 3, 130


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("batch", help="many files, objects and keys; goes on where it was stopped")
    command.add_argument("jobs", type=Path, metavar="JOBS.toml", help="the jobs; docs/reference/batch.md describes it")
    command.add_argument("--dry-run", action="store_true", help="list the jobs and what would be done; do nothing")
    command.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="JOB",
        help="a job by its number or name, with those whose results it reads; repeat for more",
    )
    command.add_argument(
        "--part", type=_part, metavar="I/N", help="the I-th of N parts of the jobs, for several machines"
    )
    command.add_argument(
        "--processes", type=_at_least_one, metavar="N", help="jobs that run at once (default: one for each core)"
    )
    command.add_argument(
        "--memory", type=_at_least_one, metavar="MB", help="memory of all jobs together (default: 3/4 of the machine's)"
    )
    command.add_argument("--dask", metavar="ADDRESS", help="run on the Dask cluster whose scheduler is there")
    command.add_argument(
        "--state", type=Path, metavar="FOLDER", help="keeps what is done (default: JOBS.batch beside JOBS.toml)"
    )
    command.add_argument("--report", type=Path, metavar="REPORT.json", help="(default: report.json in that folder)")
    command.set_defaults(run=partial(_run, commands.choices))
    child.add_to(commands)


def _part(text: str) -> tuple[int, int]:
    first, _, second = text.partition("/")
    try:
        part, parts = int(first), int(second)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a part such as 2/5") from None
    if not 1 <= part <= parts:
        raise argparse.ArgumentTypeError(f"there is no part {text}; the first of five is 1/5, the last 5/5")
    return part, parts


def _at_least_one(text: str) -> int:
    number = whole_number(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is not possible; give 1 or more")
    return number


def _run(parsers: Mapping[str, argparse.ArgumentParser], arguments: argparse.Namespace) -> int:
    if arguments.dask is not None and (arguments.processes or arguments.memory):
        raise InputError("On a Dask cluster its workers decide about processes and memory; leave those options out.")
    every = read_jobs(arguments.jobs, parsers)
    jobs = _chosen(every, arguments.only, arguments.part)
    base = arguments.jobs.resolve().parent
    state = State(arguments.state or base / f"{arguments.jobs.stem}.batch", base, version())
    state = State(state.folder.resolve(), base, version())
    if arguments.dry_run:
        _list(jobs, state)
        return 0
    part = "" if arguments.part is None else "-{}-of-{}".format(*arguments.part)
    report = arguments.report or state.folder / f"report{part}.json"
    state.make_folder()
    require_writable(report, inputs=[arguments.jobs, *(path for job in every for path in (job.file, *job.outputs))])
    return _carried_out(jobs, state, arguments, report)


def _chosen(jobs: Sequence[Job], only: Sequence[str], part: tuple[int, int] | None) -> list[Job]:
    """The jobs that were asked for."""
    chosen = set(range(1, len(jobs) + 1))
    if only:
        known = {str(job.number): job for job in jobs} | {job.name: job for job in jobs}
        missing = [name for name in only if name not in known]
        if missing:
            raise InputError(f"There is no job {missing[0]!r}; --dry-run lists them.")
        chosen = set()
        for name in only:
            job: Job | None = known[name]
            while job is not None:  # with those that it reads the results of
                chosen.add(job.number)
                job = known[str(job.after)] if job.after is not None else None
    if part is not None:
        roots: dict[int, int] = {}
        for job in jobs:
            roots[job.number] = roots[job.after] if job.after is not None else len({*roots.values()})
        chosen = {number for number in chosen if roots[number] % part[1] == part[0] - 1}
    return [job for job in jobs if job.number in chosen]


def _list(jobs: Sequence[Job], state: State) -> None:
    to_do = set()
    for job in jobs:
        if state.record(job) is not None and job.after not in to_do:
            what = "is done"
        else:
            to_do.add(job.number)
            what = "would run" if job.after is None else f"would run after job {job.after}"
            if job.after is None and not job.file.is_file():
                what = "would fail: its file is missing"
        speech.say(on_one_line(f"{job.number}. {job.name}: {what}"))
        speech.say(on_one_line(f"   {job.command_line}"))
    speech.say(f"{len(jobs)} jobs, {len(to_do)} to do.")


def _carried_out(jobs: Sequence[Job], state: State, arguments: argparse.Namespace, report: Path) -> int:
    batch, began = uuid.uuid4().hex, clock.monotonic()
    limit_mb = arguments.memory or machine_limit_mb()
    if arguments.dask is None:
        at_once = min(arguments.processes or cores(), max(1, len(jobs)))
        pool: Pool = Processes(at_once)
    else:
        pool = cluster = Cluster(arguments.dask)
        at_once = cluster.count
    threads = max(1, cores() // at_once)

    def order(job: Job) -> Order:
        return Order(job, state, batch, threads, limit_mb)

    def say(job: Job, ended: Ended) -> None:
        if ended.how == "stopped":
            return  # the last line counts them
        memory = "" if ended.peak_memory_mb is None else f", {ended.peak_memory_mb:.0f} MB"
        took = f"  {ended.seconds:.1f} s{memory}" if ended.how == "done" else ""
        speech.say(on_one_line(f"{len(schedule.ended)}/{len(jobs)}  {ended.how:8}{job.name}{took}"))
        if ended.error is not None:
            speech.note(f"{job.name}: {ended.error[0]}: {on_one_line(ended.error[1])}")

    schedule = Schedule(jobs, state, pool, order, say)
    interrupted = False
    try:
        schedule.run()
    except KeyboardInterrupt:
        interrupted = True
        schedule.stop(batch)
    finally:
        pool.close()
    counts = Counter(ended.how for ended in schedule.ended.values())
    seconds = clock.monotonic() - began
    with making_folder(report.parent), replacing(report) as new:
        values = _report(jobs, schedule.ended, state, counts, seconds, at_once)
        new.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")
    listed = ", ".join(f"{counts[how]} {how}" for how in get_args(HowEnded) if counts[how])
    speech.say(f"{len(jobs)} jobs in {seconds:.1f} s: {listed or 'nothing to do'}. Report: {report}")
    if interrupted:
        speech.note("Interrupted; what is done stays, and the same command goes on from here.")
        return STATUS_INTERRUPTED
    return STATUS_FAILED if counts["failed"] else 0


def _report(
    jobs: Sequence[Job],
    ended: Mapping[int, Ended],
    state: State,
    counts: Mapping[HowEnded, int],
    seconds: float,
    at_once: int,
) -> dict[str, Any]:
    """The report as plain values."""

    def of(job: Job) -> dict[str, Any]:
        found = ended[job.number]
        error = None if found.error is None else dict(zip(("type", "message"), found.error, strict=True))
        return {
            "number": job.number,
            "name": job.name,
            "command": job.command_line,
            "file": state.told(job.file),
            "outputs": [state.told(path) for path in job.outputs],
            "ended": found.how,
            "error": error,
            "seconds": found.seconds,
            "peak_memory_mb": found.peak_memory_mb,
            "notes": list(found.notes),
        }

    return {
        "qc3d": state.version,
        "seconds": seconds,
        "at_once": at_once,
        **{how: counts.get(how, 0) for how in get_args(HowEnded)},
        "jobs": [of(job) for job in jobs],
    }
