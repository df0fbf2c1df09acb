# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pairs of shapes that are measured, and the limits of the listed ones."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(os.environ.get("QC3D_DATA", ROOT / "../shared/data")).resolve()
PAIRS = Path(os.environ.get("QC3D_PAIRS", ROOT / "../shared/bench/pairs.json")).resolve()

# Two shapes cannot tell these full turns: a user asks for them by an option, and so does the benchmark of ``natural``.
EXTRA_TURNS = {"bar:straight:twist450": 1, "bar:twist450:bend180": -1}


@dataclass(frozen=True)
class Pair:
    """Two shapes of one file, written ``body:rest:t_pose``.

    For each measure with a limit, ``ratios`` has the largest allowed ratio to the straight blend's value, and
    ``floors`` the value below which nobody sees a difference.
    """

    file: str
    first: str
    second: str
    ratios: dict[str, float] = field(default_factory=dict, compare=False)
    floors: dict[str, float] = field(default_factory=dict, compare=False)

    def __str__(self) -> str:
        return f"{self.file}:{self.first}:{self.second}"

    @property
    def listed(self) -> bool:
        """Whether the pair has limits."""
        return bool(self.ratios)

    @property
    def extra_turns(self) -> int:
        """Extra turns to ask for by the option."""
        return EXTRA_TURNS.get(str(self), 0)

    def load(self) -> tuple[Ints, Floats, Floats]:
        """Triangles (m, 3), first shape (n, 3), second shape (n, 3)."""
        with np.load(DATA / f"{self.file}.npz", allow_pickle=False) as stored:
            names = stored["shape_names"].tolist()
            first, second = (stored[f"V{names.index(name)}"].astype(np.float64) for name in (self.first, self.second))
            return stored["faces"].astype(np.int64), first, second

    def limits(self, straight: dict[str, Any]) -> dict[str, float]:
        """Largest allowed value of each measure, given the measures of the straight blend's worst inner frame."""
        return {name: max(straight[name] / ratio, self.floors[name]) for name, ratio in self.ratios.items()}


class Catalogue:
    """All pairs: the listed ones, then the rest shape of a file with every other, then consecutive shapes."""

    def __init__(self) -> None:
        if not PAIRS.is_file() or not DATA.is_dir():
            raise SystemExit(f"Needs the list {PAIRS} (QC3D_PAIRS) and the shapes in {DATA} (QC3D_DATA).")
        listing = json.loads(PAIRS.read_text(encoding="utf-8"))
        self.always: dict[str, float] = listing["always"]
        self.floors: dict[str, float] = listing["floor"]
        listed = [
            Pair(Path(one["file"]).stem, one["from"], one["to"], one["ratio"], self.floors | one.get("floor", {}))
            for one in listing["pairs"]
        ]
        families = sorted(path.stem for path in DATA.glob("*.npz"))
        further = [
            Pair(family, names[start], names[end], floors=self.floors)
            for family in families
            for names in [shape_names(family)]
            for start, end in [(0, k) for k in range(1, len(names))] + [(k, k + 1) for k in range(1, len(names) - 1)]
        ]
        self.pairs = listed + [pair for pair in further if pair not in listed]

    def find(self, text: str) -> Pair:
        """The pair written as ``file:first:second``, listed or not."""
        file, first, second = text.split(":") if text.count(":") == 2 else ("", "", "")
        if first not in (names := shape_names(file)) or second not in names:
            raise SystemExit(f"There is no pair {text!r} in {DATA}; write it like body:rest:t_pose.")
        wanted = Pair(file, first, second, floors=self.floors)
        return next((pair for pair in self.pairs if pair == wanted), wanted)


def shape_names(family: str) -> list[str]:
    """Names of the shapes in a file, the rest shape first; empty if there is no such file."""
    if not (DATA / f"{family}.npz").is_file():
        return []
    with np.load(DATA / f"{family}.npz", allow_pickle=False) as stored:
        return [str(name) for name in stored["shape_names"]]
