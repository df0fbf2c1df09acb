# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces painted with their distortion."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np

from qc3d_addon.solver.keys.keypair import KeyPair

from .shading import Camera, Floats, best_view, draw, upright
from .sheets import BACKGROUND, KEY_COLOR

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

_HEIGHT = 420  # height of a shape in pixels


def save_distortion(pair: KeyPair, measures: dict[str, Floats], path: Path, up: str = "z") -> None:
    """Save a picture of the first key, and of the second key painted with each of the measures (n,), ``up`` upward."""
    first, second = upright(pair.key0, up), upright(pair.key1, up)
    camera = Camera.around(np.stack([first, second]), best_view(first, second))
    columns = 1 + len(measures)
    figure, panels = pyplot.subplots(1, columns, figsize=(4.2 * columns, 5.4), layout="constrained")
    figure.set_facecolor(BACKGROUND)
    panels[0].imshow(draw(first, pair.faces, camera, _HEIGHT, KEY_COLOR, BACKGROUND))
    panels[0].set_title("first key")
    for axes, (name, values) in zip(panels[1:], measures.items(), strict=True):
        colors = scale(name, values)
        paint = np.asarray(colors.mappable.to_rgba(values[pair.faces].mean(axis=1)))[:, :3]
        axes.imshow(draw(second, pair.faces, camera, _HEIGHT, paint, BACKGROUND))
        axes.set_title(f"second key: {name}")
        add_color_bar(figure, colors, axes, location="bottom", shrink=0.7)
    for axes in panels:
        axes.axis("off")
    figure.savefig(path, dpi=100, facecolor=BACKGROUND)
    pyplot.close(figure)


class Scale(NamedTuple):
    """A logarithmic color scale from ``low`` to ``high``."""

    mappable: ScalarMappable
    low: float
    high: float

    @classmethod
    def of(cls, low: float, high: float, colors: str) -> Scale:
        """A scale that uses one of matplotlib's color maps."""
        return cls(ScalarMappable(LogNorm(low, high, clip=True), colors), low, high)


def scale(name: str, values: Floats) -> Scale:
    """A color scale for the values of a measure, clipped at their 99th percentile.

    Dilatations start at 1; other measures are symmetric about 1.
    """
    usable = values[np.isfinite(values) & (values > 0.0)]
    if "dilatation" in name:
        end = max(float(np.percentile(usable, 99)), 1.01) if len(usable) else 1.01
        return Scale.of(1.0, end, "viridis")
    away = np.percentile(np.abs(np.log(usable)), 99) if len(usable) else 0.0
    end = max(float(np.exp(away)), 1.01)
    return Scale.of(1.0 / end, end, "coolwarm")


def add_color_bar(figure: Figure, colors: Scale, axes: Any, **options: Any) -> None:  # noqa: ANN401
    """Add a color bar to ``axes``, labeled at its ends and its middle."""
    ticks = [colors.low, (colors.low * colors.high) ** 0.5, colors.high]
    bar = figure.colorbar(colors.mappable, ax=axes, **options)
    bar.set_ticks(ticks, labels=[f"{tick:.3g}" for tick in ticks])
    bar.minorticks_off()
