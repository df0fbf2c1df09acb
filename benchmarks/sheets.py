# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheets: one pair of each family, one method per row."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from qc3d_paper.drawing.sheets import Row, save_sheet

from .catalogue import Pair
from .report import NAMES, ORDER
from .results import Results

SHOWN = (
    Pair("body", "rest", "arms_overhead"),
    Pair("head", "neutral", "jawOpen"),
    Pair("head_parts", "neutral", "laugh"),
    Pair("horse", "bind", "Gallop_0"),
    Pair("wolf", "bind", "Attack_0.4"),
    Pair("fox", "bind", "Run_0.5"),
    Pair("bar", "straight", "twist270"),
)
Y_UP = ("head", "horse", "wolf", "fox")
HEIGHTS = {"bar": 280}  # pixels of a row; a column must hold its label
TITLES = {method: name.strip("`") for method, name in NAMES.items()}


def save(results: Results, folder: Path) -> list[Path]:
    """Draw the sheets of all families whose frames are stored; return the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for pair in SHOWN:
        rows = []
        for method in ORDER:
            stored = results.load_frames(pair, method)
            if stored is None:
                continue
            faces, times, frames = stored
            if pair.file in Y_UP:
                frames = frames[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])
            rows.append(Row(TITLES[method], faces, times, frames))
        if rows:
            path = folder / f"inbetweens_{pair.file}.png"
            save_sheet(rows, "auto", HEIGHTS.get(pair.file, 200), path)
            written.append(path)
    return written
