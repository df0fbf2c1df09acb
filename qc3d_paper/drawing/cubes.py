# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The cube's boundary after a map: four faces in colors, and one edge in red."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.tets.mesh import TetMesh

from .shading import Camera

# Axis, side and color of the faces; top and bottom are gray.
_FACES = (
    (0, 1.0, (0.42, 0.62, 0.85)),
    (1, 0.0, (0.93, 0.75, 0.42)),
    (0, 0.0, (0.55, 0.78, 0.55)),
    (1, 1.0, (0.75, 0.58, 0.80)),
)
_GREY, _RED = (0.85, 0.85, 0.85), (0.85, 0.05, 0.05)
_MARGIN = 0.1  # cube units around the cube, since a map may move its boundary
_DARKEST = 0.7  # brightness of a face seen edge-on


def draw_cube(axes: Axes, mesh: TetMesh, values: Floats, behind: bool = False) -> None:
    """Draw the boundary of the cube and its triangles after a map; the edge between two colored faces is red.

    Parameters
    ----------
    axes : Axes
    mesh : TetMesh
        A mesh of the unit cube.
    values : (N, 3)
        Where the map sends the mesh's vertices.
    behind : bool
        Look from the opposite side, which shows the other two colored faces and hides the red edge.
    """
    faces = mesh.boundary_faces
    corners = mesh.points[faces]
    colours = np.tile(_GREY, (len(faces), 1))
    for axis, side, colour in _FACES:
        colours[(corners[..., axis] == side).all(axis=1)] = colour
    room = np.array([[-_MARGIN] * 3, [1.0 + _MARGIN] * 3])
    camera = Camera.around(np.stack([np.array(np.meshgrid(*room.T)).reshape(3, -1).T]), "three-quarter")
    turn = np.diag([-1.0, -1.0, 1.0]) if behind else np.eye(3)
    seen = ((values - 0.5) @ turn + 0.5) @ camera.axes.T
    triangles = seen[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    facing = normals[:, 2] / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    order = np.argsort(triangles[:, :, 2].mean(axis=1))
    order = order[facing[order] > 0.0]
    shaded = colours[order] * (_DARKEST + (1.0 - _DARKEST) * facing[order, None])
    axes.add_collection(
        PolyCollection(list(triangles[order, :, :2]), facecolors=shaded, edgecolors="0.35", linewidths=0.25)
    )
    edge = np.flatnonzero((mesh.points[:, 0] == 1.0) & (mesh.points[:, 1] == 0.0))
    edge = edge[np.argsort(mesh.points[edge, 2])]
    if not behind:
        axes.add_collection(LineCollection([seen[edge, :2]], colors=[_RED], linewidths=2.5))
    axes.set_xlim(camera.low[0], camera.high[0])
    axes.set_ylim(camera.low[1], camera.high[1])
    axes.set_aspect("equal")
    axes.axis("off")
