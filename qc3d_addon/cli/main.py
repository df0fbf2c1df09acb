# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``qc3d``: in-betweens without Blender's window."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn

from ..solver.errors import InputError, reason
from . import analyze, bake, combine, compress, decompress, export, interpolate, reconstruct, replay, reproduce, speech
from .batch import command as batch
from .failures import FAILURES, told
from .version import version


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns
    -------
    int
        0 after success; 1 if all files were written, but standard output could not be; 2 after an error, with one
        sentence on standard error; 130 after an interruption. Or the status of the command itself.
    """
    problem, status = None, 0
    try:
        arguments = _parser().parse_args(argv)
        status = arguments.run(arguments) or 0
    except FAILURES as error:
        problem = str(told(error))
    except KeyboardInterrupt:
        speech.note("Interrupted; nothing was written.")
        return 130
    finally:
        speech.flush()  # the texts of --help and --version too
    unheard = speech.take_unheard()
    if problem is not None:
        speech.note(problem)
        return 2
    if unheard is not None:
        speech.note(f"Standard output cannot be written: {reason(unheard)}; all files are complete.")
        return status or 1
    return status


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="qc3d", description="In-betweens between shapes of one mesh, through fold-free maps.")
    parser.add_argument("--version", action="version", version=f"qc3d {version()}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    every = (interpolate, combine, bake, batch, export, analyze, reconstruct, compress, decompress, reproduce, replay)
    for command in every:
        command.add_to(commands)
    return parser


class _Parser(argparse.ArgumentParser):
    """Reports errors in one sentence; argparse alone would first print the usage of the whole command.

    A repeated option that takes a single value is refused; argparse would silently drop the first value.
    """

    def __init__(self, **choices: Any) -> None:  # noqa: ANN401 - whatever argparse takes
        super().__init__(**choices)
        for name in (None, "store"):
            self.register("action", name, _Once)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message[:1].upper()}{message[1:]}; see {self.prog} --help.")


class _Once(argparse.Action):
    """Stores the value of an option that may come once."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        given = vars(namespace).setdefault("given", set())
        if option_string is not None and self.dest in given:
            raise argparse.ArgumentError(self, "it is given twice; name it once")
        given.add(self.dest)
        setattr(namespace, self.dest, values)
