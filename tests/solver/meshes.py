# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small meshes and maps with known properties, for the solver's tests."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.tets.kuhn_grid import kuhn_grid
from qc3d_addon.solver.tets.mesh import TetMesh, edge_matrices


def jittered_grid(cells: int, seed: int, amount: float = 0.15) -> TetMesh:
    """A Kuhn grid whose vertices are moved by up to ``amount`` of a cell; those on the cube's faces stay on them."""
    mesh = kuhn_grid(cells)
    shift = np.random.default_rng(seed).uniform(-amount / cells, amount / cells, mesh.points.shape)
    moved = TetMesh(mesh.points + np.where(mesh.on_cube_face, 0.0, shift), mesh.tets)
    assert moved.volumes.min() > 0.0
    return moved


def random_delaunay(count: int, seed: int) -> TetMesh:
    """The Delaunay tetrahedra of random points in the cube, on its faces, on its edges and at its corners."""
    random = np.random.default_rng(seed)
    inside, on_faces, on_edges = (random.uniform(size=(size, 3)) for size in (count, count, count // 4))
    on_faces[np.arange(len(on_faces)), random.integers(3, size=len(on_faces))] = random.integers(2, size=len(on_faces))
    for row, free in enumerate(random.integers(3, size=len(on_edges))):
        on_edges[row, np.arange(3) != free] = random.integers(2, size=2)
    points = np.concatenate([kuhn_grid(1).points, on_edges, on_faces, inside])
    tets = Delaunay(points).simplices.astype(np.int64)
    # Points of one face of the cube span flat tetrahedra on it, which are no part of the volume.
    corners = points[tets]
    tets = tets[~((corners == corners[:, :1]) & ((corners == 0.0) | (corners == 1.0))).all(axis=1).any(axis=1)]
    backward = np.linalg.det(edge_matrices(points, tets)) < 0.0
    tets[backward] = tets[backward][:, [0, 2, 1, 3]]
    return TetMesh(points, tets)


def sine_map(points: Floats, amplitudes: Floats, waves: Ints) -> Floats:
    """A smooth map of the cube onto itself that slides on its faces: composed sine displacements.

    ``amplitudes`` (k, 3) and ``waves`` (k, 3, 3): displacement k moves coordinate c by its amplitude times
    sin(pi m x_c), which vanishes on the two faces that hold x_c, times cosines of the other two coordinates.
    """
    result = np.array(points)
    for amplitude, wave in zip(amplitudes, waves, strict=True):
        phases = np.pi * wave[None] * result[:, None, :]
        own = np.eye(3, dtype=bool)
        result = result + amplitude * np.where(own, np.sin(phases), np.cos(phases)).prod(axis=2)
    # sin(pi) is not zero in floating point; a bijection of the cube keeps the faces exactly.
    held = (points == 0.0) | (points == 1.0)
    return np.where(held, points, result)


def icosphere(subdivisions: int, radius: float = 0.3) -> tuple[Floats, Ints]:
    """A sphere of subdivided icosahedron triangles in the middle of the cube, normals pointing out."""
    golden = (1.0 + 5.0**0.5) / 2.0
    points = np.array(
        [[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0], [0, -1, golden], [0, 1, golden]]
        + [[0, -1, -golden], [0, 1, -golden], [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1]]
    )
    faces = np.array(
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6]]
        + [[7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10]]
        + [[8, 6, 7], [9, 8, 1]]
    )
    for _ in range(subdivisions):
        sides = np.sort(np.stack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]], axis=1), axis=2)
        edges, index = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
        first, second, third = (len(points) + index.reshape(-1, 3)).T
        points = np.concatenate([points, points[edges].mean(axis=1)])
        a, b, c = faces.T
        faces = np.concatenate(
            [np.stack(part, axis=1) for part in ((a, first, third), (b, second, first), (c, third, second))]
            + [np.stack((first, second, third), axis=1)]
        )
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return 0.5 + radius * points, faces.astype(np.int64)


def box_surface(cells: tuple[int, int, int], size: tuple[float, float, float]) -> tuple[Floats, Ints]:
    """The surface of a box centered on the z axis that stands on z = 0; triangles with normals pointing out."""
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        across, along = np.meshgrid(np.arange(cells[u]), np.arange(cells[v]), indexing="ij")
        for end in (0, cells[axis]):
            quad = np.zeros((across.size, 4, 3), dtype=np.int64)
            quad[:, :, axis] = end
            quad[:, :, u] = across.ravel()[:, None] + np.array([0, 1, 1, 0])
            quad[:, :, v] = along.ravel()[:, None] + np.array([0, 0, 1, 1])
            quads.append(quad if end else quad[:, ::-1])
    corners = np.concatenate(quads)
    grid, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    loops = index.reshape(-1, 4)
    faces = np.concatenate([loops[:, [0, 1, 2]], loops[:, [0, 2, 3]]])
    points = grid / np.array(cells) * np.array(size) - np.array([0.5 * size[0], 0.5 * size[1], 0.0])
    return points, faces


def sheet(cells: tuple[int, int], size: tuple[float, float]) -> tuple[Floats, Ints]:
    """A flat grid of quads in the xy plane, around the origin: the lower side of a box."""
    box, faces = box_surface((*cells, 1), (*size, 1.0))
    low = np.flatnonzero(box[:, 2] == 0.0)
    number = np.full(len(box), -1)
    number[low] = np.arange(len(low))
    kept = number[faces]
    return box[low], kept[(kept >= 0).all(axis=1)]


def twisted(points: Floats, angle: float) -> Floats:
    """Points turned about the z axis, by 0 at their lowest z to ``angle`` (radians) at their highest."""
    height = points[:, 2] - points[:, 2].min()
    turns = np.zeros_like(points)
    turns[:, 2] = angle * height / height.max()
    return np.asarray(np.einsum("nij,nj->ni", rotation_matrices(turns), points))


def bent(points: Floats, angle: float) -> Floats:
    """Points bent in the x-z plane by ``angle`` (radians) in all, their axis as long as before, its middle in place."""
    low, high = points[:, 2].min(), points[:, 2].max()
    radius = (high - low) / angle
    along = (points[:, 2] - 0.5 * (low + high)) / radius
    x = radius - (radius - points[:, 0]) * np.cos(along)
    z = 0.5 * (low + high) + (radius - points[:, 0]) * np.sin(along)
    return np.column_stack([x, points[:, 1], z])


def arced(points: Floats, angle: float) -> Floats:
    """A bar of length 5 whose upper half is bent along an arc; the lower half stays exactly where it is."""
    radius = 2.5 / angle
    along = (points[:, 2] - 2.5) / radius
    x, z = radius - (radius - points[:, 0]) * np.cos(along), 2.5 + (radius - points[:, 0]) * np.sin(along)
    return np.where(points[:, 2:] > 2.5, np.column_stack([x, points[:, 1], z]), points)


def enclosed_volume(points: Floats, faces: Ints) -> float:
    """Volume inside a closed surface."""
    first, second, third = (points[faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", first, np.cross(second, third))) / 6.0
