# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 6 and 7 (section 6.1): sequences of faces and of bodies, by the paper's interpolation and by ours."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from qc3d_addon.solver.api import Fit
from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.frames.measures import EdgeExcess
from qc3d_addon.solver.keys.keypair import KeyPair

from ..drawing.shading import upright
from ..drawing.sheets import Row, save_sheet, straight_blend
from . import shapes
from .caption import Caption
from .shapes import Pose

TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
_MILD = 0.05  # 99 of 100 edges within 5 % of their lengths in the keys look right
_CLAIMS = {
    "6": "Mild sequences, faces: the shapes in between, from the representation interpolated linearly, look right.",
    "7": "Extreme sequences, bodies: the interpolation may work properly in some extreme cases too.",
}


def draw(number: str, poses: tuple[Pose, ...], data: Path | None, file: BinaryIO) -> Caption:
    """Draw three sequences, each by straight blend, mode ``linear`` (the paper's) and mode ``natural``.

    Mode ``linear`` has the paper's own sampling of the cube.
    """
    rows, texts, excesses, folded = [], [], [], 0
    for pose in poses:
        pair = shapes.read(pose, data)
        linear = Fit(shapes.fitted(pair, shapes.PUBLISHED)).inbetweens(TIMES, mode="linear")
        natural = Fit(shapes.fitted(pair)).inbetweens(TIMES, mode="natural")
        found = [
            Row(mode, pair.faces, np.array(TIMES), bake.frames)
            for mode, bake in (("linear", linear), ("natural", natural))
        ]
        found.insert(0, straight_blend(found[0]))
        excess = [_excess(pair, row.frames) for row in found]
        excesses.append(excess)
        folds = sum(linear.report.folds.frames or [])
        folded += folds
        texts.append(
            f"{pose.label}: straight blend {excess[0]:.1%}, linear {excess[1]:.1%}, natural {excess[2]:.1%}; folded "
            f"tetrahedra in the frames of linear {folds}"
        )
        rows += [
            row._replace(label=f"{pose.second}\n{row.label}", frames=upright(row.frames, pose.up)) for row in found
        ]
    save_sheet(rows, "three-quarter" if number == "6" else "auto", 150, file)
    right = [linear < _MILD for _, linear, _ in excesses]
    better = sum(linear < straight for straight, linear, _ in excesses)
    ours = sum(natural < _MILD for *_, natural in excesses)
    counts = (
        f"{sum(right)} of {len(right)} sequences stay within {_MILD:.0%}, {better} keep lengths better than a straight "
        f"blend, {folded} tetrahedra fold; mode natural, which keeps the rotation that the representation does not "
        f"hold, stays within in {ours}."
    )
    wanted = all(right) if number == "6" else any(right)
    holds = f"{'Yes' if wanted and not folded else 'In part' if any(right) or better else 'No'}: {counts}"
    title = "; ".join(pose.label for pose in poses) + ": straight blend, linear (the paper's), natural (ours)"
    measured = (
        "How far 99 of 100 edges stay within the interval of their lengths in the two keys, at the worst of three "
        "moments. " + ". ".join(texts) + "."
    )
    return Caption(number, title, _CLAIMS[number], measured, holds)


def _excess(pair: KeyPair, frames: Floats) -> float:
    measure = EdgeExcess(pair)
    return max(0.0, *(float(np.percentile(measure.of(frame), 99)) for frame in frames))
