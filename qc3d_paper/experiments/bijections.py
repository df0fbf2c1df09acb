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

from ..drawing.cubes import draw_cube
from ..drawing.slices import cut
from . import shapes
from .caption import Caption

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

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
    figure, panels = pyplot.subplots(1, 4, figsize=(16, 4.2), layout="constrained")
    draw_cube(panels[0], mesh, mesh.points)
    panels[0].set_title("the cube")
    draw_cube(panels[1], mesh, rebuilt.values)
    panels[1].set_title("rebuilt from the representation")
    _draw_slice(panels[2], mapping, rebuilt)
    panels[3].hist(np.log10(np.maximum(error, 1e-17)), 40, color="0.4")
    panels[3].set_xlabel("log₁₀ of a vertex's error")
    panels[3].set_ylabel("vertices")
    figure.savefig(file, dpi=100)
    pyplot.close(figure)
    largest = float(error.max())
    return Caption(
        number,
        f"{title}: the cube, the rebuilt map, a slice, and the error",
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


def _draw_slice(axes: Axes, mapping: Mapping, rebuilt: Mapping) -> None:
    """Draw a slice through the middle of the cube after the map, colored by the volume ratio."""
    rows, polygons = cut(rebuilt.values, mapping.mesh.tets, 2, 0.5)
    ratio = np.log2(np.linalg.det(mapping.jacobians)[rows])
    drawn = PolyCollection(list(polygons), array=ratio, cmap="coolwarm", edgecolor="0.3", linewidth=0.2)
    drawn.set_clim(-2.0, 2.0)
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.autoscale()
    axes.set_title("slice z = ½; log₂ of the volume ratio, −2 … 2")
