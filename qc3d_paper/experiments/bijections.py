# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 3 to 5 (section 5.4): bijections of the cube, reconstructed from their representation."""

from __future__ import annotations

from collections.abc import Callable
from typing import BinaryIO

import matplotlib
import numpy as np

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.maps.boundary_conditions import Conditions
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.maps.reconstruction import reconstruct
from qc3d_addon.solver.tets.mesh import TetMesh

from ..drawing.cubes import draw_cube, draw_open_cube
from ..drawing.slices import cut
from . import shapes
from .caption import Caption

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.ticker import MaxNLocator

BIJECTIONS: dict[str, tuple[str, Callable[[Floats], Floats]]] = {
    "3": ("every coordinate stretched by itself", shapes.along_axes),
    "4": ("a whirl inside the cube, up to 90°", shapes.whirl),
    "5": ("waves that slide on the faces", shapes.sliding),
}
_CLAIM = "A bijection of the cube is rebuilt from its representation with an error near machine precision."
_EXACT = 1e-9  # cube units; far above rounding of the linear systems, far below anything visible


def draw(number: str, title: str, mapping: Mapping, file: BinaryIO) -> Caption:
    """Draw one of the figures: the map on the cube's faces, a slice, and the errors of the reconstruction."""
    mesh = mapping.mesh
    rebuilt = reconstruct(mesh, mapping.stretch, Conditions.sliding_cube(mesh))
    error = np.linalg.norm(rebuilt.values - mapping.values, axis=1)
    figure = pyplot.figure(figsize=(16, 7.6), layout="constrained")
    panels = figure.subplots(2, 3)
    for column, shown, name in ((0, mapping, "target"), (1, rebuilt, "rebuilt from the representation")):
        draw_cube(panels[0, column], mesh, shown.values)
        panels[0, column].set_title(name)
        drawn = _draw_slice(panels[1, column], shown)
        panels[1, column].set_title(f"{name}: cut at z = ½")
    figure.colorbar(drawn, ax=panels[1, :2], label="volume ratio, log₂", shrink=0.9)
    draw_open_cube(panels[0, 2], mesh, rebuilt.values)
    panels[0, 2].set_title("rebuilt: the planes z = ¼, ½, ¾")
    panels[1, 2].hist(np.log10(np.maximum(error, 1e-17)), 40, color="0.4")
    panels[1, 2].xaxis.set_major_locator(MaxNLocator(5))
    panels[1, 2].set_xlabel("error of a vertex, log₁₀ of cube sides")
    panels[1, 2].set_ylabel("vertices")
    panels[1, 2].set_title("distance of rebuilt from target")
    figure.savefig(file, dpi=100)
    pyplot.close(figure)
    largest = float(error.max())
    return Caption(
        number,
        f"{title}: target and rebuilt map, slices, the inside, and the error",
        _CLAIM,
        f"{len(mesh.points)} vertices, {len(mesh.tets)} tetrahedra, dilatation up to "
        f"{np.linalg.cond(mapping.stretch).max():.3g}: largest error {largest:.1e} of the cube's side, "
        f"root mean square {np.sqrt((error**2).mean()):.1e}; folds {rebuilt.folds}.",
        "Yes." if largest < _EXACT else "No: the error is larger than rounding explains.",
    )


def without_folds(mesh: TetMesh, title: str, bijection: Callable[[Floats], Floats]) -> tuple[str, Mapping]:
    """The piecewise linear map with the bijection's values at the vertices, and its title.

    Where that map would fold, because the mesh is too coarse, all displacements are damped until it does not, and the
    title says by how much.

    Raises
    ------
    InputError
        If it folds even with a tenth of the displacements.
    """
    for percent in (100, 90, 80, 70, 60, 50, 25, 10):
        mapping = Mapping(mesh, mesh.points + percent / 100.0 * (bijection(mesh.points) - mesh.points))
        if mapping.folds == 0:
            return title if percent == 100 else f"{title}, {percent} % of the displacements", mapping
    raise InputError(f"The mesh is too coarse for this map: {title}.")


def _draw_slice(axes: Axes, mapping: Mapping) -> PolyCollection:
    """Draw a slice through the middle of the cube after the map, colored by the volume ratio."""
    rows, polygons = cut(mapping.values, mapping.mesh.tets, 2, 0.5)
    ratio = np.log2(np.linalg.det(mapping.jacobians)[rows])
    drawn = PolyCollection(list(polygons), array=ratio, cmap="coolwarm", edgecolor="0.3", linewidth=0.2)
    drawn.set_clim(-2.0, 2.0)
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.autoscale()
    axes.set_xlabel("x")
    axes.set_ylabel("y")
    return drawn
