# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of the heat map and the range of values that they stand for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Color = tuple[float, float, float]

# A diverging map from blue through gray to red, which color-blind people can tell apart too; both arms have equal steps
# in lightness (Moreland 2009, "Diverging color maps for scientific visualization").
_DIVERGING: tuple[Color, ...] = (
    (0.13, 0.31, 0.65), (0.42, 0.62, 0.85), (0.87, 0.87, 0.87), (0.90, 0.57, 0.45), (0.70, 0.10, 0.16),
)  # fmt: skip
# From gray through orange to dark red.
_SEQUENTIAL: tuple[Color, ...] = (
    (0.87, 0.87, 0.87), (0.95, 0.78, 0.52), (0.90, 0.52, 0.30), (0.75, 0.25, 0.25), (0.45, 0.05, 0.25),
)  # fmt: skip

# Blender's menu of the measures.
MEASURE_ITEMS = (
    ("stretch", "Stretch", "Length of the surface over its length in the first key"),
    ("volume", "Volume", "Volume of the space around a vertex over its volume in the first key"),
    ("dilatation", "Dilatation", "How unevenly space around a vertex is stretched: longest over shortest axis"),
)

# Round numbers for the ends of the scale; the smallest that covers ``_HELD`` percent of the values is used.
_ENDS = (1.02, 1.05, 1.1, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0)
_HELD = 95.0  # percent of the vertices, in the frame that is distorted most


class Scale(NamedTuple):
    """The values that the colors of a measure stand for, from ``low`` to ``high``, on a logarithmic scale."""

    title: str
    low: float
    high: float
    colors: tuple[Color, ...]

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Positions along the scale, in [0, 1], and the values there as text."""
        values = (self.low, 1.0, self.high) if self.low < 1.0 else (1.0, self.high**0.5, self.high)
        return [(place, f"{value:.3g}") for place, value in zip((0.0, 0.5, 1.0), values, strict=True)]


_TITLES = {
    "stretch": "Stretch: length / length in the first key",
    "volume": "Volume / volume in the first key",
    "dilatation": "Dilatation K: longest / shortest axis",
}


def scale_of(measure: str, values: NDArray[np.float32]) -> Scale:
    """The scale for the values (k, n) of a measure."""
    away = np.percentile(np.abs(np.log(np.maximum(values, 1e-6))), _HELD, axis=1).max()
    end = next((end for end in _ENDS if np.log(end) >= away), _ENDS[-1])
    return _scale(measure, end)


def scale_between(measure: str, low: float, high: float) -> Scale:
    """The scale of a measure with these ends; raises ValueError or KeyError if ``scale_of`` cannot have made it."""
    if high not in _ENDS or _scale(measure, high).low != low:
        raise ValueError("no ends of a scale")
    return _scale(measure, high)


def _scale(measure: str, end: float) -> Scale:
    if measure == "dilatation":
        return Scale(_TITLES[measure], 1.0, end, _SEQUENTIAL)
    return Scale(_TITLES[measure], 1.0 / end, end, _DIVERGING)


def linear(color: Color) -> Color:
    """An sRGB color in the linear color space of Blender's attributes."""
    red, green, blue = (
        value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in color
    )
    return red, green, blue
