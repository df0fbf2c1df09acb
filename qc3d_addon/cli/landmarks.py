# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of landmarks, as written by people and by spreadsheets."""

from __future__ import annotations

import codecs
import csv
from pathlib import Path

import numpy as np

from ..solver.arrays import Floats, Ints
from ..solver.errors import InputError
from ..solver.files.npz import require_file, unreadable

_COLUMNS = ("vertex", "x", "y", "z")
_SEPARATORS = ";\t,"  # in the order in which they are looked for: a comma may be a decimal one
_MOST_BYTES = 2**28
_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_landmarks(path: Path) -> tuple[Ints, Floats]:
    """Read a table of landmarks: vertices (k,) and their targets (k, 3), NaN where a coordinate is free.

    The columns vertex, x, y and z may be in any order and in capitals. Cells are separated by commas, semicolons or
    tabs; except with commas, decimal commas are allowed. The encoding is UTF-8, or UTF-16 with a byte-order mark.

    Raises
    ------
    InputError
        If the file cannot be read or is not such a table.
    """
    rows = _rows(path)
    header = [cell.strip().lower() for cell in rows[0][1]] if rows else []
    while header and not header[-1]:
        header.pop()
    if sorted(header) != sorted(_COLUMNS):
        found = f"begins with {','.join(header)}" if header else "is empty"
        raise InputError(f"{path} {found}; it must begin with the row {','.join(_COLUMNS)}.")
    order = [header.index(name) for name in _COLUMNS]
    vertices, values = [], []
    for number, row in rows[1:]:
        try:
            if len(row) < len(_COLUMNS) or any(cell.strip() for cell in row[len(_COLUMNS) :]):
                raise ValueError("four cells are needed")
            vertex, *places = (_number(row[place]) for place in order)
            if not vertex == round(vertex):
                raise ValueError(f"{vertex} is not a vertex number")
        except (ValueError, OverflowError) as error:
            raise InputError(f"{path}, row {number}: {error}; correct the row.") from error
        vertices.append(round(vertex))
        values.append(places)
    if not vertices:
        raise InputError(f"{path} names no landmarks; give a row for each.")
    if max(map(abs, vertices)) >= 2**62:
        raise InputError(f"{path} names vertices that no mesh has; correct their numbers.")
    return np.array(vertices), np.array(values)


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """The rows that are not empty, with their numbers in the file, from 1."""
    require_file(path, _MOST_BYTES)
    try:
        data = path.read_bytes()
        text = data.decode("utf-16" if data.startswith(_WIDE_MARKS) else "utf-8-sig")
        lines = text.splitlines()
        named = lines and lines[0].lower().startswith("sep=")  # by which Excel is told
        first = 1 if named else 0
        beginning = lines[first] if len(lines) > first else ""
        separator = next((mark for mark in _SEPARATORS if mark in beginning), ",")
        rows = list(enumerate(csv.reader(lines[first:], delimiter=separator), start=1 + first))
    except (OSError, UnicodeError, csv.Error) as error:
        raise unreadable(path, error) from error
    if separator != ",":
        rows = [(number, [cell.replace(",", ".") for cell in row]) for number, row in rows]
    return [(number, row) for number, row in rows if any(cell.strip() for cell in row)]


def _number(cell: str) -> float:
    return float(cell) if cell.strip() else np.nan
