# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Planar cuts through tetrahedral meshes, and pictures of measures of maps."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.maps.analysis import Analysis

from .surfaces import add_color_bar, scale

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.ticker import FuncFormatter, Locator, LogLocator, MaxNLocator, NullFormatter

_AXES = "xyz"
_HISTOGRAM_BINS = 80
_NARROW, _WIDE = 3.0, 30.0  # the largest value over the smallest: below there are even ticks, above powers of ten
# Edges that a plane crosses, by sorted corner: from the single corner on one side to the three others, or from the two
# corners on one side to the two on the other.
_ONE = np.array([[0, 1], [0, 2], [0, 3], [0, 3]])
_TWO = np.array([[0, 2], [0, 3], [1, 3], [1, 2]])


class Cuts(NamedTuple):
    """Where a plane cuts tetrahedra: polygons of four corners on edges; a triangle has its last corner twice.

    Parameters
    ----------
    tets : (k,) int64
        The tetrahedra that are cut.
    ends : (k, 4, 2) int64
        The vertices at the ends of each corner's edge.
    parts : (k, 4)
        How far along its edge each corner lies, 0..1.
    """

    tets: Ints
    ends: Ints
    parts: Floats

    def of(self, values: Floats) -> Floats:
        """(k, 4, 3) the corners of the polygons where the vertices are at ``values`` (N, 3)."""
        first, second = values[self.ends[..., 0]], values[self.ends[..., 1]]
        return np.asarray(first + self.parts[..., None] * (second - first))


def cuts(points: Floats, tets: Ints, axis: int, place: float) -> Cuts:
    """Cut tetrahedra by an axis-aligned plane.

    Parameters
    ----------
    points : (N, 3)
        Vertices.
    tets : (M, 4) int64
        Tetrahedra.
    axis : int
        Axis perpendicular to the plane: 0, 1 or 2.
    place : float
        Coordinate of the plane along that axis.
    """
    above = points[tets, axis] > place
    count = above.sum(axis=1)
    found = []
    for number, side, ends in ((1, above, _ONE), (3, ~above, _ONE), (2, above, _TWO)):
        rows = np.flatnonzero(count == number)
        # Corners sorted so that the single one comes first, or the two above the plane.
        order = np.argsort(~side[rows], axis=1, kind="stable")
        corners = np.take_along_axis(tets[rows], order, axis=1)[:, ends]
        along = points[corners, axis]
        found.append(Cuts(rows, corners, (place - along[..., 0]) / (along[..., 1] - along[..., 0])))
    return Cuts(*(np.concatenate(column) for column in zip(*found, strict=True)))


def cut(points: Floats, tets: Ints, axis: int, place: float) -> tuple[Ints, Floats]:
    """The tetrahedra (k,) that a plane cuts, as ``cuts``, and polygons (k, 4, 2) in the other two coordinates."""
    found = cuts(points, tets, axis, place)
    return found.tets, found.of(points)[..., [other for other in range(3) if other != axis]]


def draw_slice(axes: Axes, analysis: Analysis, axis: int, place: float, measure: str) -> None:
    """Draw the cut of a plane through the source mesh, colored by a measure of the analysis."""
    mesh = analysis.mapping.mesh
    rows, polygons = cut(mesh.points, mesh.tets, axis, place)
    values = analysis.measures[measure]
    colors = scale(measure, values).mappable
    drawn = PolyCollection(list(polygons), array=values[rows], norm=colors.norm, cmap=colors.cmap)
    drawn.set_edgecolor("face")
    drawn.set_linewidth(0.2)
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.autoscale()
    across, up = (name for number, name in enumerate(_AXES) if number != axis)
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.set_title(f"{_AXES[axis]} = {place:.3g}")


def save_slices(analysis: Analysis, path: Path) -> None:
    """Save slices through the middle of the source along all three axes, of the dilatation and of the volume ratio."""
    middle = 0.5 * (analysis.mapping.mesh.points.min(axis=0) + analysis.mapping.mesh.points.max(axis=0))
    figure, panels = pyplot.subplots(2, 3, figsize=(13, 8), layout="constrained")
    for row, (measure, title) in enumerate((("dilatation", "dilatation K"), ("volume_ratio", "volume ratio"))):
        for axis in range(3):
            draw_slice(panels[row, axis], analysis, axis, float(middle[axis]), measure)
        add_color_bar(figure, scale(measure, analysis.measures[measure]), panels[row], label=title, shrink=0.9)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def save_histograms(analysis: Analysis, path: Path) -> None:
    """Save histograms, weighted by the source's volume, of eigenvalues, volume ratio and dilatations."""
    mesh = analysis.mapping.mesh
    share = 100.0 * mesh.volumes / mesh.volumes.sum()
    shown = {
        "eigenvalues a, b, c": dict(zip("abc", analysis.eigenvalues.T, strict=True)),
        "volume ratio abc": {"": analysis.measures["volume_ratio"]},
        "dilatations": {
            "K = a / c": analysis.measures["dilatation"],
            "outer, a² / bc": analysis.measures["outer_dilatation"],
            "inner, ab / c²": analysis.measures["inner_dilatation"],
        },
    }
    figure, panels = pyplot.subplots(1, 3, figsize=(13, 3.8), layout="constrained")
    for axes, (title, curves) in zip(panels, shown.items(), strict=True):
        known = {label: (values > 0.0) & np.isfinite(values) for label, values in curves.items()}
        every = np.concatenate([values[known[label]] for label, values in curves.items()])
        low, high = (every.min(), every.max()) if len(every) else (1.0, 1.0)
        bins = np.geomspace(low / 1.01, high * 1.01, _HISTOGRAM_BINS)
        for label, values in curves.items():
            axes.hist(values[known[label]], bins, weights=share[known[label]], histtype="step", label=label)
        axes.set_xscale("log")
        axes.set_ylim(1e-4, 200.0)
        axes.set_yscale("log")
        axes.set_xlim(bins[0], bins[-1])
        # A logarithmic axis of few decades would have a label at every minor tick.
        axes.xaxis.set_major_locator(_ticks(bins[-1] / bins[0]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel(title)
        axes.axvline(1.0, color="0.7", linewidth=0.8, zorder=0)
        if len(curves) > 1:
            axes.legend()
    panels[0].set_ylabel("% of the volume")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _ticks(ratio: float) -> Locator:
    """Where a logarithmic axis has labels."""
    if ratio < _NARROW:
        return MaxNLocator(4)
    return LogLocator(subs=(1.0, 2.0, 5.0)) if ratio < _WIDE else LogLocator()
