# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheets and moving pictures: the frames of several bakes, all drawn through one camera."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

import matplotlib
import numpy as np

from .shading import Camera, Floats, Ints, best_view, draw

matplotlib.use("Agg")
from matplotlib import pyplot
from PIL import Image

BACKGROUND = (0.93, 0.93, 0.93)
KEY_COLOR = (0.55, 0.68, 0.86)
INBETWEEN_COLOR = (0.93, 0.75, 0.58)
SCENERY_COLOR = (0.97, 0.97, 0.97)
_DOTS_PER_INCH = 100
_FRAME, _PAUSE = 40, 600  # milliseconds that a moving picture shows an in-between, and a key
_COLORS = 64  # of a moving picture: shading stays smooth, and files small


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


def save_animation(rows: list[Row], view: str, height: int, file: Path | BinaryIO) -> None:
    """Draw the rows as moving pictures beside each other, to the last key and back, and save them as a GIF.

    Parameters
    ----------
    rows : list of Row
        Rows with equally many frames.
    view, height, file
        See ``save_sheet``.
    """
    if view == "auto":
        view = best_view(rows[0].frames[0], rows[0].frames[-1])
    camera = Camera.around(np.concatenate([row.frames for row in rows]), view)
    moments = len(rows[0].times)
    drawn = [_moment(rows, index, camera, height) for index in range(moments)]
    # All frames share the colors of a key and of an in-between, so that nothing flickers.
    both = np.concatenate([np.asarray(drawn[index]) for index in (0, moments // 2)])
    palette = Image.fromarray(both).quantize(_COLORS)
    order = [*range(moments), *range(moments - 2, 0, -1)]
    pictures = [drawn[index].quantize(palette=palette, dither=Image.Dither.NONE) for index in order]
    durations = [_PAUSE if index in (0, moments - 1) else _FRAME for index in order]
    pictures[0].save(
        file, format="GIF", save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True
    )


def _moment(rows: list[Row], index: int, camera: Camera, height: int) -> Image.Image:
    """All rows at one moment, side by side below their labels."""
    sheet = np.concatenate([_picture(row, index, camera, height) for row in rows], axis=1)
    top = 30  # pixels for the labels
    size = (sheet.shape[1], top + height)
    figure = pyplot.figure(figsize=(size[0] / _DOTS_PER_INCH, size[1] / _DOTS_PER_INCH), dpi=_DOTS_PER_INCH)
    figure.set_facecolor(BACKGROUND)
    figure.figimage(sheet, xo=0, yo=0, origin="upper")
    for column, row in enumerate(rows):
        place = (column + 0.5) / len(rows)
        figure.text(place, 1.0 - top / 2 / size[1], row.label, ha="center", va="center", fontsize=13)
    memory = BytesIO()
    figure.savefig(memory, format="png", dpi=_DOTS_PER_INCH, facecolor=BACKGROUND)
    pyplot.close(figure)
    return Image.open(memory).convert("RGB")


def _picture(row: Row, index: int, camera: Camera, height: int) -> Floats:
    color = KEY_COLOR if index in (0, len(row.times) - 1) else INBETWEEN_COLOR
    paint = np.tile(color, (len(row.faces), 1))
    paint[len(row.faces) - row.scenery :] = SCENERY_COLOR
    return draw(row.frames[index], row.faces, camera, height, paint, BACKGROUND)
