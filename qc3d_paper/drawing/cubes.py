# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The cube after a map: its boundary, four faces in colors and one edge in red, and its inside, cut open."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.tets.mesh import TetMesh

from .shading import Camera
from .slices import cuts

# Axis, side and color of the faces; top and bottom are gray.
_FACES = (
    (0, 1.0, (0.42, 0.62, 0.85)),
    (1, 0.0, (0.93, 0.75, 0.42)),
    (0, 0.0, (0.55, 0.78, 0.55)),
    (1, 1.0, (0.75, 0.58, 0.80)),
)
_GRAY, _RED = (0.85, 0.85, 0.85), (0.85, 0.05, 0.05)
_MARGIN = 0.1  # cube units around the cube, since a map may move its boundary
_SHEETS = ((0.25, (0.55, 0.75, 0.95)), (0.5, (0.98, 0.86, 0.55)), (0.75, (0.65, 0.88, 0.65)))  # heights and colors
_GLASS = 0.12  # opacity of the transparent faces
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
    colors, seen, camera = _colors(mesh), _seen(values, behind), _camera()
    triangles, facing = _triangles(seen, mesh.boundary_faces)
    order = np.argsort(triangles[:, :, 2].mean(axis=1))
    order = order[facing[order] > 0.0]
    shaded = colors[order] * (_DARKEST + (1.0 - _DARKEST) * facing[order, None])
    axes.add_collection(
        PolyCollection(list(triangles[order, :, :2]), facecolors=shaded, edgecolors="0.35", linewidths=0.25)
    )
    if not behind:
        _draw_edge(axes, mesh, seen)
    _frame(axes, camera)


def draw_open_cube(axes: Axes, mesh: TetMesh, values: Floats) -> None:
    """Draw the inside of the cube after a map: where it sends the planes z = 1/4, 1/2 and 3/4, seen through two faces.

    The two transparent faces meet at the red edge. What is farther is drawn first.

    Parameters
    ----------
    axes : Axes
    mesh : TetMesh
        A mesh of the unit cube.
    values : (N, 3)
        Where the map sends the mesh's vertices.
    """
    seen = _seen(values, behind=False)
    polygons, colors = [], []
    for place, color in _SHEETS:
        sheet = cuts(mesh.points, mesh.tets, 2, place).of(seen)
        normals = np.cross(sheet[:, 2] - sheet[:, 0], sheet[:, 3] - sheet[:, 1])
        flat = np.linalg.norm(normals, axis=1) < 1e-300
        light = np.abs(normals[:, 2]) / np.where(flat, 1.0, np.linalg.norm(normals, axis=1))
        polygons.append(sheet)
        colors.append(np.array(color) * (_DARKEST + (1.0 - _DARKEST) * light[:, None]))
    sheets, paint = np.concatenate(polygons), np.concatenate(colors)
    order = np.argsort(sheets[:, :, 2].mean(axis=1))
    axes.add_collection(
        PolyCollection(list(sheets[order, :, :2]), facecolors=paint[order], edgecolors="0.35", linewidths=0.2)
    )
    triangles, _ = _triangles(seen, mesh.boundary_faces)
    corners = mesh.points[mesh.boundary_faces]
    clear = (corners[..., 0] == 1.0).all(axis=1) | (corners[..., 1] == 0.0).all(axis=1)
    glass = np.column_stack([_colors(mesh)[clear], np.full(np.count_nonzero(clear), _GLASS)])
    axes.add_collection(PolyCollection(list(triangles[clear, :, :2]), facecolors=glass, edgecolors="none"))
    for axis, side in ((0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)):
        _draw_rim(axes, mesh, seen, axis, float(side))
    _draw_edge(axes, mesh, seen)
    _frame(axes, _camera())


def _colors(mesh: TetMesh) -> Floats:
    corners = mesh.points[mesh.boundary_faces]
    colors = np.tile(_GRAY, (len(corners), 1))
    for axis, side, color in _FACES:
        colors[(corners[..., axis] == side).all(axis=1)] = color
    return colors


def _camera() -> Camera:
    room = np.array([[-_MARGIN] * 3, [1.0 + _MARGIN] * 3])
    return Camera.around(np.stack([np.array(np.meshgrid(*room.T)).reshape(3, -1).T]), "three-quarter")


def _seen(values: Floats, behind: bool) -> Floats:
    turn = np.diag([-1.0, -1.0, 1.0]) if behind else np.eye(3)
    return np.asarray(((values - 0.5) @ turn + 0.5) @ _camera().axes.T)


def _triangles(seen: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """(F, 3, 3) triangles and (F,) how far each faces the camera, -1..1."""
    triangles = seen[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return triangles, normals[:, 2] / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)


def _draw_edge(axes: Axes, mesh: TetMesh, seen: Floats) -> None:
    edge = np.flatnonzero((mesh.points[:, 0] == 1.0) & (mesh.points[:, 1] == 0.0))
    edge = edge[np.argsort(mesh.points[edge, 2])]
    axes.add_collection(LineCollection([seen[edge, :2]], colors=[_RED], linewidths=2.5))


def _draw_rim(axes: Axes, mesh: TetMesh, seen: Floats, axis: int, side: float) -> None:
    """The two edges of a face of the cube that go along the axis after its own."""
    along = (axis + 1) % 3
    across = (axis + 2) % 3
    for end in (0.0, 1.0):
        edge = np.flatnonzero((mesh.points[:, axis] == side) & (mesh.points[:, across] == end))
        edge = edge[np.argsort(mesh.points[edge, along])]
        axes.add_collection(LineCollection([seen[edge, :2]], colors=["0.3"], linewidths=0.8))


def _frame(axes: Axes, camera: Camera) -> None:
    axes.set_xlim(camera.low[0], camera.high[0])
    axes.set_ylim(camera.low[1], camera.high[1])
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
