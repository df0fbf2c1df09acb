# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Interior tetrahedra that contain every vertex of a surface.

These are the Delaunay tetrahedra, of the surface's vertices and samples of its interior, that lie inside. They need not
contain the surface's triangles, which as-rigid-as-possible interpolation never uses. So surfaces that cross themselves
or have slits are no obstacle, as they would be for a constrained tetrahedralization.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from .gradients import Floats, Ints


def fill(positions: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Points (the surface's vertices first, then samples) and positively oriented tetrahedra inside the surface.

    A vertex without an inner tetrahedron gets the deepest of its tetrahedra, if the winding number there is at least
    one quarter; otherwise it stays loose.
    """
    points = np.concatenate([positions, interior_samples(positions, faces)])
    tetrahedra = Delaunay(points).simplices.astype(np.int64)
    corners = points[tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    backward = volumes < 0.0
    tetrahedra[backward] = tetrahedra[backward][:, [0, 2, 1, 3]]
    pairs = [(a, b) for a in range(4) for b in range(a)]
    longest = np.max([np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in pairs], axis=0)
    solid = np.abs(volumes) > 1e-4 * longest**3  # flatter ones are slivers of almost coplanar or cospherical points
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
    """Jittered points of a body-centered lattice inside the surface, about as many as it has vertices."""
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


def winding_numbers(queries: Floats, positions: Floats, faces: Ints, sizes: tuple[int, ...] = (8, 32, 128)) -> Floats:
    """Generalized winding number (q,) of each query point.

    A. Jacobson, L. Kavan, O. Sorkine: Robust inside-outside segmentation using generalized winding numbers. 2013. The
    triangles are clustered in the cells of nested grids, with ``sizes`` cells along the longest side. A cell that is
    far away acts as one dipole (G. Barill et al.: Fast winding numbers for soups and clouds. 2018); a close one is
    replaced by what it contains.
    """
    levels = Level.nested(positions[faces], sizes)
    total = np.zeros(len(queries))
    for part in np.array_split(np.arange(len(queries)), len(queries) // 5000 + 1):
        query = np.repeat(np.arange(len(part)), len(levels[0].reach))
        member = np.tile(np.arange(len(levels[0].reach)), len(part))
        for level in levels:
            offset = level.middles[member] - queries[part][query]
            distance = np.sqrt((offset * offset).sum(axis=1))
            far = distance > 2.2 * level.reach[member]
            flux = (offset[far] * level.dipoles[member[far]]).sum(axis=1) / distance[far] ** 3
            total[part] += np.bincount(query[far], flux, len(part))
            query, member = query[~far], member[~far]
            count = level.counts[member]
            within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
            query, member = np.repeat(query, count), level.members[np.repeat(level.starts[member], count) + within]
        angles = solid_angles(positions[faces[member]] - queries[part][query, None])
        total[part] += np.bincount(query, angles, len(part))
    return total / (4.0 * np.pi)


class Level(NamedTuple):
    """The cells of one grid: their centers, dipoles and radii, and the cells or triangles that each contains."""

    middles: Floats
    dipoles: Floats
    reach: Floats
    members: Ints
    starts: Ints
    counts: Ints

    @classmethod
    def nested(cls, corners: Floats, sizes: tuple[int, ...]) -> list[Level]:
        """Levels from the coarsest to the finest, whose members are the triangles (m, 3, 3)."""
        centers = corners.mean(axis=1)
        normals = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        place = (centers - centers.min(axis=0)) / np.ptp(centers, axis=0).max()
        parents = np.zeros(len(corners), dtype=np.int64)
        labels = []
        for size in sizes:
            cell = np.minimum((place * size).astype(np.int64), size - 1) @ (1, size, size * size)
            parents = np.unique(parents * size**3 + cell, return_inverse=True)[1].ravel()
            labels.append(parents)
        levels = []
        for depth, label in enumerate(labels):
            finer = labels[depth + 1] if depth + 1 < len(labels) else np.arange(len(corners))
            first = np.unique(finer, return_index=True)[1]
            counts = np.bincount(label[first])
            triangles = np.bincount(label)
            order = np.argsort(label, kind="stable")
            starts = np.cumsum(triangles) - triangles
            middles = np.add.reduceat(centers[order], starts) / triangles[:, None]
            spread = np.linalg.norm(corners - middles[label][:, None], axis=2).max(axis=1)
            levels.append(
                cls(
                    middles,
                    np.add.reduceat(normals[order], starts),
                    np.maximum.reduceat(spread[order], starts),
                    np.argsort(label[first], kind="stable"),
                    np.cumsum(counts) - counts,
                    counts,
                )
            )
        return levels


def solid_angles(corners: Floats) -> Floats:
    """Signed solid angles (m,) under which triangles (m, 3, 3) appear from the origin (van Oosterom, Strackee 1983)."""
    a, b, c = corners.transpose(1, 0, 2)
    la, lb, lc = np.linalg.norm(corners, axis=2).T
    ab, bc, ca = ((u * v).sum(axis=1) for u, v in ((a, b), (b, c), (c, a)))
    triple = (a * np.cross(b, c)).sum(axis=1)
    return np.asarray(2.0 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb))
