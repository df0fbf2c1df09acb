# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The cube's boundary, four faces in colours and one edge in red, before and after a map."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ..solver.tetmesh import Floats, TetMesh
from .shading import Camera, draw
from .sheets import BACKGROUND

_HEIGHT = 380  # pixels
# Axis, side and colour of the faces; the others are grey.
_FACES = (
    (0, 1.0, (0.42, 0.62, 0.85)),
    (1, 0.0, (0.93, 0.75, 0.42)),
    (2, 1.0, (0.55, 0.78, 0.55)),
    (0, 0.0, (0.75, 0.58, 0.80)),
)
_GREY, _RED = (0.8, 0.8, 0.8), (0.85, 0.1, 0.1)
_MARGIN = 0.12


def draw_cube(axes: Axes, mesh: TetMesh, values: Floats) -> None:
    """Draw where a map (N, 3) sends the boundary; the edge between the right and the front face is red."""
    faces = mesh.boundary_faces
    corners = mesh.points[faces]
    colours = np.tile(_GREY, (len(faces), 1))
    for axis, side, colour in _FACES:
        colours[(corners[..., axis] == side).all(axis=1)] = colour
    on_edge = (corners[..., 0] == 1.0) & (corners[..., 1] == 0.0)
    colours[on_edge.any(axis=1)] = _RED
    room = np.array([[-_MARGIN] * 3, [1.0 + _MARGIN] * 3])
    camera = Camera.around(np.stack([np.array(np.meshgrid(*room.T)).reshape(3, -1).T]), "three-quarter")
    axes.imshow(draw(values, faces, camera, _HEIGHT, colours, BACKGROUND))
    axes.axis("off")
