# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 6 and 7 (section 6.1): sequences of faces and of bodies, by the paper's interpolation and by ours."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from qc3d_addon.solver.api import Fit
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.frames.measures import worst_excess
from qc3d_addon.solver.settings import Mode

from ..drawing.shading import upright
from ..drawing.sheets import Row, save_sheet, straight_blend
from . import shapes
from .caption import Caption
from .shapes import Pose

MODES: tuple[Mode, ...] = ("linear", "natural")
TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
_MILD = 0.05  # edge lengths up to 5 % beyond those of the keys are taken as natural
_CLAIMS = {
    "6": "Mild sequences, faces: interpolating the representation linearly gives natural shapes in between.",
    "7": "Extreme sequences, bodies: interpolating the representation linearly gives natural shapes in between too.",
}


def draw(number: str, poses: tuple[Pose, ...], data: Path | None, file: BinaryIO) -> Caption:
    """Draw three sequences, each by straight blend, mode ``linear`` (the paper's) and mode ``natural``."""
    rows, texts, excesses, folded = [], [], [], 0
    for pose in poses:
        pair = shapes.read(pose, data)
        fit = Fit(shapes.fitted(pair))
        bakes: dict[str, Bake] = {
            mode: fit.inbetweens(TIMES, mode=mode)
            for mode in MODES
        }
        found = [Row(mode, pair.faces, np.array(TIMES), bake.frames) for mode, bake in bakes.items()]
        found.insert(0, straight_blend(found[0]))
        excess = [worst_excess(pair, row.frames).excess for row in found]
        excesses.append(excess)
        folds = sum(bakes["linear"].report.folds.frames or [])
        folded += folds
        texts.append(
            f"{pose.label}: worst edge beyond its lengths in the keys, straight blend {excess[0]:.1%}, linear "
            f"{excess[1]:.1%}, natural {excess[2]:.1%}; folded tetrahedra in the frames of linear {folds}"
        )
        rows += [
            row._replace(label=f"{pose.second}\n{row.label}", frames=upright(row.frames, pose.up)) for row in found
        ]
    save_sheet(rows, "three-quarter" if number == "6" else "auto", 150, file)
    worst = np.max(excesses, axis=0)
    if worst[1] < _MILD and not folded:
        holds = "Yes."
    elif worst[1] < worst[0]:
        holds = "In part: better than the straight blend, but lengths are not kept; mode natural keeps them better."
    else:
        holds = (
            "No: the representation holds no rotation, so where parts turn the paper's interpolation keeps lengths no "
            "better than a straight blend. Mode natural keeps the rotation too."
        )
    title = "; ".join(pose.label for pose in poses) + ": straight blend, linear (the paper's), natural (ours)"
    return Caption(number, title, _CLAIMS[number], ". ".join(texts) + ".", holds)
