# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Interior tetrahedra that contain every vertex of a surface.

The Delaunay tetrahedra of the surface's vertices and of samples of the interior, as far as they lie inside. They need
not contain the surface's triangles (which as-rigid-as-possible interpolation never asks for), so a surface that
crosses itself or has slits is no obstacle, as it would be for a constrained tetrahedralisation.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, cKDTree
from scipy.spatial.distance import cdist

from .gradients import Floats, Ints


def fill(positions: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Points (the surface's vertices first, then samples) and positively oriented tetrahedra inside the surface.

    A vertex that no inner tetrahedron touches gets the one of its tetrahedra that is deepest inside, if any of them is
    inside by a quarter at least; else it stays loose.
    """
    points = np.concatenate([positions, interior_samples(positions, faces)])
    tetrahedra = Delaunay(points).simplices.astype(np.int64)
    corners = points[tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    backward = volumes < 0.0
    tetrahedra[backward] = tetrahedra[backward][:, [0, 2, 1, 3]]
    pairs = [(a, b) for a in range(4) for b in range(a)]
    longest = np.max([np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in pairs], axis=0)
    solid = np.abs(volumes) > 1e-4 * longest**3  # what is flatter is a sliver between points of one plane or sphere
    tetrahedra, corners = tetrahedra[solid], corners[solid]
    winding = winding_numbers(corners.mean(axis=1), positions, faces)
    inside = winding > 0.5
    loose = np.setdiff1d(np.arange(len(points)), tetrahedra[inside])
    touched = np.isin(tetrahedra, loose)
    candidates = np.flatnonzero(touched.any(axis=1) & (winding > 0.25))
    candidates = candidates[np.argsort(-winding[candidates])]
    rows, columns = np.nonzero(touched[candidates])
    inside[candidates[rows[np.unique(tetrahedra[candidates[rows], columns], return_index=True)[1]]]] = True
    return points, tetrahedra[inside]


def interior_samples(positions: Floats, faces: Ints, seed: int = 0) -> Floats:
    """Jittered points of a body-centred lattice inside the surface, about as many as it has vertices."""
    a, b, c = positions[faces.T] - positions.mean(axis=0)
    volume = abs(float((a * np.cross(b, c)).sum())) / 6.0
    spacing = (2.0 * volume / len(positions)) ** (1.0 / 3.0)
    low, high = positions.min(axis=0), positions.max(axis=0)
    axes = [np.arange(start, end, spacing) for start, end in zip(low, high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    lattice = np.concatenate([lattice, lattice + 0.5 * spacing])
    lattice += np.random.default_rng(seed).uniform(-0.1, 0.1, lattice.shape) * spacing
    distance = cKDTree(np.concatenate([positions, positions[faces].mean(axis=1)])).query(lattice)[0]
    lattice = lattice[distance > 0.5 * spacing]
    return np.asarray(lattice[winding_numbers(lattice, positions, faces) > 0.5])


def winding_numbers(queries: Floats, positions: Floats, faces: Ints, cells: int = 40) -> Floats:
    """Generalised winding number (q,) of each query point.

    A. Jacobson, L. Kavan, O. Sorkine: Robust inside-outside segmentation using generalized winding numbers. 2013. The
    triangles are gathered in the cells of a grid; a cell that is far away acts as one dipole (G. Barill et al.:
    Fast winding numbers for soups and clouds. 2018), a near one triangle by triangle.
    """
    corners = positions[faces]
    centres = corners.mean(axis=1)
    normals = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    grid = np.floor((centres - centres.min(axis=0)) / (np.ptp(centres, axis=0).max() / cells)).astype(np.int64)
    cell = np.unique(np.minimum(grid, cells - 1), axis=0, return_inverse=True)[1].ravel()
    sizes = np.bincount(cell)
    starts = np.cumsum(sizes) - sizes
    members = np.argsort(cell, kind="stable")
    middles = np.add.reduceat(centres[members], starts) / sizes[:, None]
    dipoles = np.add.reduceat(normals[members], starts)
    spread = np.linalg.norm(corners - middles[cell][:, None], axis=2).max(axis=1)
    reach = np.maximum.reduceat(spread[members], starts)
    total = np.zeros(len(queries))
    for part in np.array_split(np.arange(len(queries)), len(queries) * len(sizes) // 4_000_000 + 1):
        distances = cdist(queries[part], middles)
        near = distances < 2.5 * reach
        flux = (middles * dipoles).sum(axis=1) - queries[part] @ dipoles.T
        total[part] = np.where(near, 0.0, flux / np.where(near, 1.0, distances) ** 3).sum(axis=1)
        query, close = np.nonzero(near)
        count = sizes[close]
        within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        query = np.repeat(query, count)
        triangle = members[np.repeat(starts[close], count) + within]
        angles = solid_angles(corners[triangle] - queries[part][query, None])
        total[part] += np.bincount(query, angles, len(part))
    return total / (4.0 * np.pi)


def solid_angles(corners: Floats) -> Floats:
    """Signed solid angles (m,) under which triangles (m, 3, 3) appear from the origin (van Oosterom, Strackee 1983)."""
    a, b, c = corners.transpose(1, 0, 2)
    la, lb, lc = np.linalg.norm(corners, axis=2).T
    ab, bc, ca = ((u * v).sum(axis=1) for u, v in ((a, b), (b, c), (c, a)))
    triple = (a * np.cross(b, c)).sum(axis=1)
    return np.asarray(2.0 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb))
