# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where in a TOML file its tables and keys stand; Python's own reader does not tell."""

from __future__ import annotations

import re

Place = tuple[str | int, ...]

_STRING = re.compile(r'"(?:[^"\\]|\\.)*"|\'[^\']*\'')
_HEADER = re.compile(r"\s*(\[\[?)([^\[\]]+)\]\]?\s*$")
_KEY = re.compile(r"""\s*(?:"([^"]*)"|'([^']*)'|([\w-]+))\s*=""")


def lines_of(text: str) -> dict[Place, int]:
    """The line, from 1, of each table and of each key in it, of a valid file.

    A table's place is its keys from the outermost, with the number from 0 behind an array's; that of a key has its name
    behind them. Keys in inline tables are not told.

    Examples
    --------
    >>> lines_of("[[job]]\\nfile = 'a.blend'\\n[[job.then]]\\noutput = 'b.glb'\\n")
    {('job', 0): 1, ('job', 0, 'file'): 2, ('job', 0, 'then', 0): 3, ('job', 0, 'then', 0, 'output'): 4}
    """
    found: dict[Place, int] = {}
    counts: dict[Place, int] = {}
    table: Place = ()
    quotes, depth = "", 0  # of a text, or arrays, that go on from the line before
    for number, line in enumerate(text.splitlines(), 1):
        if quotes:
            if line.count(quotes) % 2:
                quotes = ""
            continue
        plain = line
        for mark in ('"""', "'''"):
            if line.count(mark) % 2:
                quotes, plain = mark, line[: line.index(mark)]
        bare = _STRING.sub("''", plain).partition("#")[0]
        if depth == 0:
            header, key = _HEADER.match(bare), _KEY.match(plain)
            if header is not None:
                table = _table(header, counts)
                found[table] = number
                continue
            if key is not None:
                found[(*table, next(name for name in key.groups() if name is not None))] = number
        depth = max(0, depth + sum(map(bare.count, "[{")) - sum(map(bare.count, "]}")))
    return found


def _table(header: re.Match[str], counts: dict[Place, int]) -> Place:
    place: Place = ()
    names = [name.strip() for name in header[2].split(".")]
    for depth, name in enumerate(names, 1):
        place += (name,)
        if depth == len(names) and header[1] == "[[":
            counts[place] = counts.get(place, 0) + 1
        if place in counts:
            place += (counts[place] - 1,)
    return place
