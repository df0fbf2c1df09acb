# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The options of a command, as keys of a table: which there are, and the words of a command line that they make."""

from __future__ import annotations

import argparse
import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ...solver.errors import InputError

_NOT_OPTIONS = ("help", "output", "report")


@dataclass(frozen=True)
class Options:
    """The options of a command.

    Parameters
    ----------
    parser : ArgumentParser
        The parser of its command line.
    every : dict
        Its options by their long names.
    """

    parser: argparse.ArgumentParser
    every: dict[str, argparse.Action]

    @classmethod
    def of(cls, parser: argparse.ArgumentParser) -> Options:
        """The options of a parser."""
        named = [(word[2:], action) for action in parser._actions for word in action.option_strings]
        return cls(parser, {name: action for name, action in named if action.dest != "help"})

    @property
    def names(self) -> list[str]:
        """Names of the options that are keys of a table: all except those for files."""
        return [name for name in self.every if name not in _NOT_OPTIONS]

    def chosen(self, table: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
        """The options in a table, and those of the defaults that it neither has nor excludes."""
        found = {name: value for name, value in table.items() if name in self.names}
        excluded = {
            id(action)
            for group in self.parser._mutually_exclusive_groups
            for action in group._group_actions
            if any(self.every[name] in group._group_actions for name, value in found.items() if value is not False)
        }
        for name, value in defaults.items():
            if name in self.names and name not in found and id(self.every[name]) not in excluded:
                found[name] = value
        return found

    def words(self, name: str, value: object) -> list[str]:
        """The words of a command line that give an option its value.

        Raises
        ------
        InputError
            If the option takes no such value.
        """
        action, option = self.every[name], f"--{name}"
        if action.nargs == 0:
            if not isinstance(value, bool):
                raise InputError(f"{name} is true or false.")
            return [option] if value else []
        values = value if isinstance(value, list) else [value]
        if isinstance(action, argparse._AppendAction):
            if action.nargs is None:
                return [f"{option}={_text(name, one)}" for one in values]
            groups: list[Any] = values if all(isinstance(one, list) for one in values) else [values]
            return [word for group in groups for word in (option, *(_text(name, one) for one in group))]
        if action.nargs is not None:
            return [option, *(_text(name, one) for one in values)]
        if isinstance(value, list):
            raise InputError(f"{name} takes one value, not a list.")
        return [f"{option}={_text(name, value)}"]


def _text(name: str, value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise InputError(f"{name} takes no value {value!r}; a text in quotes or a number is needed.")
    return str(value)


def nearest(name: str, known: Iterable[str]) -> str:
    """A clause that names what may have been meant: what is spelled nearly so, or else all that there is."""
    known = list(known)
    near = difflib.get_close_matches(name, known, 1) or difflib.get_close_matches(name.replace("_", "-"), known, 1)
    return f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(known)}"
