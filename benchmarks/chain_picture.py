# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of a chain: an animator's own frames, and how far off other ways to fill in what is between keys are.

    python -m benchmarks.chain_picture docs/images/chain.png

The environment variable QC3D_DATA says where the clip is. Colors tell the distance of each vertex from its place in the
animator's frame; their scale is *cividis*, which people with and without color blindness see alike (Nuñez, Anderton &
Renslow 2018).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib
import numpy as np

from qc3d_paper.drawing.shading import Camera, draw, upright

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from .catalogue import Floats, Ints
from .clips import METHODS, clip
from .measures import diagonal

CLIP, STEP, SHOWN = "wolf_gallop", 6, 7  # keys at every sixth frame; so many frames are shown, the first a key
ROWS = {"straight": "straight", "cubic spline, natural": "cubic spline", "chain": "QC3D, chain"}
LARGEST = 0.06  # distance over the diagonal with the darkest color
_VIEW, _HEIGHT, _DOTS = "side", 140, 100
_LEFT, _TOP, _RIGHT = 34, 26, 110  # pixels around the pictures
_BACKGROUND, _PLAIN = (0.93, 0.93, 0.93), (0.75, 0.75, 0.75)


def main() -> None:
    """Compute and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output", type=Path, metavar="PICTURE.png")
    output = parser.parse_args().output
    faces, truth = clip(CLIP)
    truth = truth[: (len(truth) - 1) // STEP * STEP + 1]
    times = np.linspace(0.0, 1.0, len(truth))
    made = {title: METHODS[name](truth[::STEP], faces, times) for name, title in ROWS.items()}
    figure = picture(faces, truth, made, busiest(truth, made["straight"]))
    figure.savefig(output, dpi=_DOTS, facecolor=_BACKGROUND)


def busiest(truth: Floats, straight: Floats) -> int:
    """The key from which on straight lines are farthest from the frames (t, n, 3) that are shown."""
    missed = ((straight - truth) ** 2).sum(axis=(1, 2))
    return max(range(0, len(truth) - SHOWN + 1, STEP), key=lambda first: float(missed[first : first + SHOWN].sum()))


def picture(faces: Ints, truth: Floats, made: dict[str, Floats], first: int) -> Figure:
    """The animator's frames (t, n, 3) from the first on, and below them those of each method."""
    shown = slice(first, first + SHOWN)
    true, unit = upright(truth[shown], "y"), diagonal(truth[0])
    rows = {title: upright(frames[shown], "y") for title, frames in made.items()}
    camera = Camera.around(np.concatenate([true, *rows.values()]), _VIEW)
    scale = ScalarMappable(Normalize(0.0, LARGEST), "cividis_r")
    drawn = [[draw(shape, faces, camera, _HEIGHT, _PLAIN, _BACKGROUND) for shape in true]]
    for frames in rows.values():
        off = np.linalg.norm(frames - true, axis=2)[:, faces].mean(axis=2) / unit
        paints = scale.to_rgba(off.ravel())[:, :3].reshape(*off.shape, 3)
        drawn.append(
            [
                draw(shape, faces, camera, _HEIGHT, paint, _BACKGROUND)
                for shape, paint in zip(frames, paints, strict=True)
            ]
        )
    width = drawn[0][0].shape[1]
    size = (_LEFT + SHOWN * width + _RIGHT, _TOP + len(drawn) * _HEIGHT)
    figure = pyplot.figure(figsize=(size[0] / _DOTS, size[1] / _DOTS), dpi=_DOTS)
    for number, (title, pictures) in enumerate(zip(["animator", *rows], drawn, strict=True)):
        bottom = (len(drawn) - 1 - number) * _HEIGHT
        figure.figimage(np.concatenate(pictures, axis=1), xo=_LEFT, yo=bottom, origin="upper")
        middle = (_LEFT / 2 / size[0], (bottom + _HEIGHT / 2) / size[1])
        figure.text(*middle, title, rotation=90, ha="center", va="center")
    for number in range(SHOWN):
        label = f"frame {first + number}" + (", key" if (first + number) % STEP == 0 else "")
        place = ((_LEFT + (number + 0.5) * width) / size[0], 1.0 - _TOP / 2 / size[1])
        figure.text(*place, label, ha="center", va="center")
    axes = figure.add_axes((1.0 - 0.85 * _RIGHT / size[0], 0.1, 14 / size[0], 0.6))
    figure.colorbar(scale, cax=axes, label="off the animator's frame, over the diagonal")
    return figure


if __name__ == "__main__":
    main()
