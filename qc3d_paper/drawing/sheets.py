# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheets: the frames of several bakes, one bake per row, all drawn through one camera."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO, NamedTuple

import matplotlib
import numpy as np

from .shading import Camera, Floats, Ints, best_view, draw

matplotlib.use("Agg")
from matplotlib import pyplot

BACKGROUND = (0.93, 0.93, 0.93)
KEY_COLOUR = (0.55, 0.68, 0.86)
INBETWEEN_COLOUR = (0.93, 0.75, 0.58)
SCENERY_COLOUR = (0.97, 0.97, 0.97)
_DOTS_PER_INCH = 100


class Row(NamedTuple):
    """One row of a sheet.

    Parameters
    ----------
    label : str
        Text beside the row.
    faces : (m, 3) int64
        Triangles.
    times : (k,)
        Times of the frames.
    frames : (k, n, 3)
        Shapes of the mesh; the first and the last are the keys.
    scenery : int
        Number of triangles, at the end of ``faces``, that belong to the surroundings and are painted gray.
    """

    label: str
    faces: Ints
    times: Floats
    frames: Floats
    scenery: int = 0

    def with_scenery(self, points: Floats, faces: Ints) -> Row:
        """The row with an additional fixed mesh: vertices (c, 3) and triangles (f, 3)."""
        still = np.broadcast_to(points, (len(self.frames), *points.shape))
        return self._replace(
            faces=np.concatenate([self.faces, faces + self.frames.shape[1]]),
            frames=np.concatenate([self.frames, still], axis=1),
            scenery=self.scenery + len(faces),
        )


def straight_blend(row: Row) -> Row:
    """The row that Blender's own sliders would give between the same keys: each vertex moves along a straight line."""
    weight = row.times[:, None, None]
    return row._replace(label="straight blend", frames=(1.0 - weight) * row.frames[0] + weight * row.frames[-1])


def save_sheet(rows: list[Row], view: str, height: int, file: Path | BinaryIO) -> None:
    """Draw all rows through one camera and save them as a PNG.

    Parameters
    ----------
    rows : list of Row
    view : str
        One of ``VIEWS``, or ``auto`` for the view that shows the motion best.
    height : int
        Height of a row in pixels.
    file : Path or BinaryIO
    """
    if view == "auto":
        view = best_view(rows[0].frames[0], rows[0].frames[-1])
    camera = Camera.around(np.concatenate([row.frames for row in rows]), view)
    pictures = [[_picture(row, index, camera, height) for index in range(len(row.times))] for row in rows]
    columns = max(len(row) for row in pictures)
    width = pictures[0][0].shape[1]
    left, top = 44, 30  # pixels for the labels of rows and columns
    size = (left + columns * width, top + len(rows) * height)
    figure = pyplot.figure(figsize=(size[0] / _DOTS_PER_INCH, size[1] / _DOTS_PER_INCH), dpi=_DOTS_PER_INCH)
    figure.set_facecolor(BACKGROUND)
    for number, (row, drawn) in enumerate(zip(rows, pictures, strict=True)):
        bottom = (len(rows) - 1 - number) * height
        sheet = np.concatenate(drawn, axis=1)
        figure.figimage(sheet, xo=left, yo=bottom, origin="upper")
        figure.text(
            left / 2 / size[0], (bottom + height / 2) / size[1], row.label, rotation=90, ha="center", va="center"
        )
        for index, time in enumerate(row.times if number == 0 else ()):
            label = {0.0: "first key", 1.0: "second key"}.get(float(time), f"{time:.3g}")
            figure.text(
                (left + (index + 0.5) * width) / size[0], 1.0 - top / 2 / size[1], label, ha="center", va="center"
            )
    figure.savefig(file, dpi=_DOTS_PER_INCH, facecolor=BACKGROUND)
    pyplot.close(figure)


def _picture(row: Row, index: int, camera: Camera, height: int) -> Floats:
    colour = KEY_COLOUR if index in (0, len(row.times) - 1) else INBETWEEN_COLOUR
    paint = np.tile(colour, (len(row.faces), 1))
    paint[len(row.faces) - row.scenery :] = SCENERY_COLOUR
    return draw(row.frames[index], row.faces, camera, height, paint, BACKGROUND)
