# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The file that describes the jobs of a batch."""

from __future__ import annotations

import argparse
import glob
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

from ...solver.errors import InputError
from ...solver.files.atomic import identities
from ...solver.files.npz import require_file, unreadable
from .job import COMMANDS, Job
from .options_of import Options, nearest
from .toml_lines import Place, lines_of

_NAME = "{name}"
_OWN = ("command", "name", "file", "output", "report", "in-place", "then")
_NOT_IN_DEFAULTS = ("name", "file", "then")
_FILE_OPTIONS = ("output", "report")
_LARGEST = 10_000_000  # bytes
_NOT_SETTINGS = {"run", "check", "given", "output", "report"}


def read_jobs(path: Path, parsers: Mapping[str, argparse.ArgumentParser]) -> list[Job]:
    """Read and check the jobs of a file. Relative paths in it start from its folder.

    Parameters
    ----------
    path : Path
        The TOML file; docs/reference/batch.md describes it.
    parsers : dict
        The parser of each of ``COMMANDS``; it decides which keys a job may have, and checks their values.

    Raises
    ------
    InputError
        If the file cannot be read or a job in it cannot be used; the text names the line.
    """
    require_file(path, _LARGEST)
    try:
        text = path.read_text(encoding="utf-8")
        values = tomllib.loads(text)
    except (OSError, UnicodeDecodeError) as error:
        raise unreadable(path, error) from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path} is no valid TOML: {error}; texts need quotes, for example.") from error
    reader = _Reader(path, values, lines_of(text), {name: Options.of(parsers[name]) for name in COMMANDS})
    return reader.jobs()


@dataclass(frozen=True)
class _Found:
    """A job with its place in the file."""

    job: Job
    place: Place
    is_in_place: bool
    is_matched: bool


class _Reader:
    """Reads the tables of a file as jobs."""

    def __init__(
        self, path: Path, values: dict[str, Any], lines: dict[Place, int], options: dict[str, Options]
    ) -> None:
        self._path = path
        self._values = values
        self._lines = lines
        self._options = options
        self._folder = path.resolve().parent
        self._count = 0  # of jobs so far
        self._defaults: dict[str, Any] = self._table(values.get("defaults", {}), ("defaults",))

    def jobs(self) -> list[Job]:
        self._require_known(self._values, (), ("defaults", "job"), "this file")
        every = {name: None for options in self._options.values() for name in options.names}
        allowed = [name for name in (*_OWN, *every) if name not in _NOT_IN_DEFAULTS]
        self._require_known(self._defaults, ("defaults",), allowed, "the defaults")
        tables = self._values.get("job")
        if not isinstance(tables, list) or not tables:
            self._refuse("it has no job; begin each with a line [[job]]", ("job",))
        found: list[_Found] = []
        for number, table in enumerate(tables):
            place = ("job", number)
            for file, stem, is_matched in self._files(self._table(table, place), place):
                found += self._expanded(table, place, file, stem, is_matched, None)
        found = self._without_results(found)
        if not found:
            self._refuse("its patterns match nothing but what its jobs write", ("job",))
        # Numbers count what is left: those of jobs that are made by others move with them.
        numbers = {one.job.number: number for number, one in enumerate(found, 1)}
        found = [
            replace(one, job=replace(one.job, number=numbers[one.job.number], after=numbers.get(one.job.after or 0)))
            for one in found
        ]
        self._require_apart(found)
        return [one.job for one in found]

    def _files(self, table: dict[str, Any], place: Place) -> Iterator[tuple[Path, str, bool]]:
        """The files of a job, the text for {name}, and whether a pattern found them."""
        if "file" not in table:
            self._refuse(f'{_called(place)} has no file; add the line file = "…"', place)
        pattern = self._text(table["file"], (*place, "file"))
        path = self._folder / pattern
        if not re.search(r"[*?\[]", pattern) or path.exists():
            yield path, path.stem, False
            return
        matches = sorted(match for match in glob.glob(str(path), recursive=True) if os.path.isfile(match))
        if not matches:
            self._refuse(f"no file matches {pattern!r}", (*place, "file"))
        for match in matches:
            yield Path(match), Path(match).stem, True

    def _expanded(
        self, table: dict[str, Any], place: Place, file: Path, stem: str, is_matched: bool, after: int | None
    ) -> list[_Found]:
        """The job of a table for one file, and those that go on from what it writes."""
        self._count += 1
        job, is_in_place = self._job(table, place, file, stem, self._count, after)
        found = [_Found(job, place, is_in_place, is_matched)]
        then = table.get("then", [])
        if not isinstance(then, list):
            self._refuse("what follows a job begins with a line [[job.then]], in double brackets", (*place, "then"))
        for number, following in enumerate(then):
            inner = (*place, "then", number)
            if "file" in self._table(following, inner):
                self._refuse(
                    "a job under [[job.then]] reads what the job before wrote; leave file out", (*inner, "file")
                )
            found += self._expanded(following, inner, job.output, stem, is_matched, job.number)
        return found

    def _job(
        self, table: dict[str, Any], place: Place, file: Path, stem: str, number: int, after: int | None
    ) -> tuple[Job, bool]:
        command = self._text(table.get("command", self._defaults.get("command", "bake")), (*place, "command"))
        if command not in COMMANDS:
            self._refuse(f"there is no command {command!r} for jobs{nearest(command, COMMANDS)}", (*place, "command"))
        options = self._options[command]
        self._require_known(table, place, (*_OWN, *options.names), f"{_called(place)}, a job of qc3d {command}")
        is_in_place = table.get("in-place", self._defaults.get("in-place", False) if "output" not in table else False)
        if not isinstance(is_in_place, bool):
            self._refuse("in-place is true or false", (*place, "in-place"))
        if is_in_place and ("output" in table or after is not None):
            self._refuse("a job in-place has no output of its own; leave one of both out", (*place, "in-place"))
        output = file if is_in_place else self._result(table, "output", place, stem)
        if output is None:
            self._refuse(f'{_called(place)} has no output; add the line output = "…"', place)
        report = self._result(table, "report", place, stem) if "report" in options.every else None
        if "report" in table and report is None:
            self._refuse(f"qc3d {command} writes no report; leave it out", (*place, "report"))
        words: list[str] = []
        for name, value in options.chosen(table, self._defaults).items():
            at = (*place, name) if name in table else ("defaults", name)
            try:
                words += options.words(name, value)
            except InputError as error:
                self._refuse(str(error).rstrip("."), at)
        shown = os.path.relpath(output, self._folder).replace(os.sep, "/")
        name = self._text(table.get("name", shown), (*place, "name")).replace(_NAME, stem)
        job = Job(number, name, command, tuple(words), file, output, report, after, {})
        return replace(job, settings=self._checked(job, options, place)), is_in_place

    def _result(self, table: dict[str, Any], key: str, place: Place, stem: str) -> Path | None:
        """The path of a result, or None where neither the job nor the defaults name one."""
        at = (*place, key) if key in table else ("defaults", key)
        value = table.get(key, self._defaults.get(key))
        if value is None:
            return None
        text = self._text(value, at)
        unknown = re.search(r"\{\w*\}", text.replace(_NAME, ""))
        if unknown is not None:
            self._refuse(f"{unknown[0]} in {key} stands for nothing; {_NAME} stands for the file's name", at)
        return self._folder / text.replace(_NAME, stem)

    def _checked(self, job: Job, options: Options, place: Place) -> dict[str, Any]:
        """The settings of a job whose options go together."""
        try:
            arguments = options.parser.parse_args(job.arguments)
            if hasattr(arguments, "check"):
                arguments.check(arguments)
        except InputError as error:
            text = re.sub(r"; see qc3d \w+ --help\.$|\.$", "", str(error))
            named = re.search(r"--([a-z-]+)", text)
            text = re.sub(r"(Argument )?--(?=[a-z])", "", text)  # options are keys here
            self._refuse(f"{_called(place)}: {text}", (*place, named[1]) if named is not None else place)
        files = {action.dest for action in options.parser._actions if not action.option_strings}
        settings = {key: value for key, value in vars(arguments).items() if key not in _NOT_SETTINGS | files}
        return {"command": job.command, "format": job.output.suffix.lower(), "report": job.report is not None} | {
            key: list(value) if isinstance(value, tuple) else value for key, value in settings.items()
        }

    def _without_results(self, found: list[_Found]) -> list[_Found]:
        """Leave out what patterns matched only because an earlier run wrote it."""
        written = {key: one for one in found for path in one.job.outputs for key in identities(path)}
        left_out: set[int] = set()
        for one in found:
            makers = [written[key] for key in identities(one.job.file) if key in written]
            is_result = one.is_matched and one.job.after is None and any(m.job.file != one.job.file for m in makers)
            if is_result or one.job.after in left_out:
                left_out.add(one.job.number)
        return [one for one in found if one.job.number not in left_out]

    def _require_apart(self, found: Iterable[_Found]) -> None:
        """Refuse two jobs with one output or one name, and an output that is a file to read."""
        read: dict[object, str] = dict.fromkeys(identities(self._path), f"{self._path.name} itself")
        written: dict[object, Job] = {}
        names: dict[str, Job] = {}
        found = list(found)
        for one in found:
            if one.job.after is None and not one.is_in_place:
                read |= dict.fromkeys(identities(one.job.file), f"the file of {one.job.name!r}")
        for one in found:
            job, place = one.job, one.place
            for path, key in zip(job.outputs, _FILE_OPTIONS, strict=False):
                at = (*place, key) if (*place, key) in self._lines else place
                for identity in identities(path):
                    other = written.setdefault(identity, job)
                    if other is not job:
                        self._refuse(f"{job.name!r} writes the same file as {other.name!r}; give it another {key}", at)
                    if identity in read:
                        self._refuse(
                            f"{path.name} is {read[identity]}, which is never replaced; choose another {key}, or say "
                            "in-place = true",
                            at,
                        )
            if len({*map(str, job.outputs)}) < len(job.outputs):
                self._refuse("the output and the report are one file; give them two names", (*place, "report"))
            if names.setdefault(job.name, job) is not job:
                self._refuse(f"two jobs are named {job.name!r}; put {_NAME} into it, or leave it out", (*place, "name"))

    def _table(self, value: object, place: Place) -> dict[str, Any]:
        if not isinstance(value, dict):
            self._refuse(f"{place[0]} must be a table, with a line [{place[0]}] or [[{place[0]}]] above it", place[:1])
        return value

    def _text(self, value: object, place: Place) -> str:
        if not isinstance(value, str) or not value:
            self._refuse(f"{place[-1]} must be a text in quotes", place)
        return value

    def _require_known(self, table: dict[str, Any], place: Place, known: Iterable[str], what: str) -> None:
        known = list(known)
        for key in table:
            if key not in known:
                self._refuse(f"there is no key {key!r} in {what}{nearest(key, known)}", (*place, key))

    def _refuse(self, text: str, place: Place) -> NoReturn:
        """Raise the error with the line of a place, or of the nearest place around it whose line is known."""
        while place and place not in self._lines:
            place = place[:-1]
        line = f", line {self._lines[place]}" if place else ""
        raise InputError(f"{self._path}{line}: {text}{'' if text.endswith('?') else '.'}")


def _called(place: Place) -> str:
    number = "" if not isinstance(place[1], int) else f" {place[1] + 1}"
    return f"job{number}" + "".join(f", then {part + 1}" for part in place[2:] if isinstance(part, int))
