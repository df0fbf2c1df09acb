# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Graded Poisson-disk samples of the cube: dense near the surface, sparser with the distance from it.

Serves the purpose of the sampling in Chen & Lui (arXiv 2308.05333, section 6.1), but differs from it: there, samples of
one uniform Poisson disk are discarded at random, with a probability that depends on their distance from the surface;
here, the radius of the disk itself grows linearly with that distance, and nothing is discarded at random. Module
``published_samples`` has the paper's own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from ..arrays import Bools, Floats, Ints
from ..settings import Quality
from ..triangles.geometry import areas, edge_lengths
from ..triangles.topology import sides, without_piles

SizeField = Callable[[Floats], Floats]

_OVERSAMPLING = 4.0  # candidates per disk: enough to leave few gaps between the disks
_NEIGHBORS = 16  # at this oversampling, few candidates have more neighbors inside their disk
# What is thin has short edges across it, where they are this percentile of all.
_SHORT_PERCENTILE = 2.0
_SAMPLES_OF_AN_EDGE = 0.25  # the part of an edge between two samples
_COARSEST = 2.0
_COARSEST_OF_FEW = 1.6  # of surfaces of few vertices, which could not follow a finer volume
_CELLS, _MOST_CELLS = 32, 512  # along an edge of the cube
_MOST_CANDIDATES = 500_000  # of a surface: where it is folded more densely, further ones would be rejected anyway


@dataclass(frozen=True)
class Resolution:
    """Distance between samples: ``spacing`` at the surface, growing linearly away from it, up to ``largest``.

    Parameters
    ----------
    spacing, largest : float
        Cube units.
    slope : float
        Growth per unit of distance from the surface.
    enough : int
        Surfaces with fewer vertices than this have coarser samples.
    """

    spacing: float
    slope: float
    largest: float
    enough: int = 0

    def scaled(self, size: float) -> Resolution:
        """The same number of samples on a surface of another size."""
        return replace(self, spacing=size * self.spacing)

    def beside(self, points: Floats, faces: Ints) -> Resolution:
        """Coarser, up to twice, at a surface whose edges are all long, or one of few vertices.

        A box needs no fine samples on its sides, and few vertices cannot follow a fine volume.
        """
        edges = sides(faces)
        if not len(edges):
            return self
        short = float(np.percentile(edge_lengths(points, edges), _SHORT_PERCENTILE))
        coarser = min(max(1.0, _SAMPLES_OF_AN_EDGE * short / self.spacing), _COARSEST)
        few = min(max(1.0, float(np.sqrt(self.enough / len(points)))), _COARSEST_OF_FEW)
        return replace(self, spacing=max(coarser, few) * self.spacing)

    def around(self, surface: Floats) -> SizeField:
        """Distance between samples as a function of position, around a surface given by samples (k, 3)."""
        tree = cKDTree(surface)

        def size(positions: Floats) -> Floats:
            distance: Floats = np.asarray(tree.query(positions)[0])
            return np.minimum(self.spacing + self.slope * distance, self.largest, dtype=np.float64)

        return size


# With "normal" the in-betweens of mode natural are as good as with finer volumes (docs/science/speed.md). The finer
# ones are for measures of the volume and for mode linear.
RESOLUTIONS: dict[Quality, Resolution] = {
    "normal": Resolution(spacing=0.03, slope=0.3, largest=0.12, enough=2000),
    "fine": Resolution(spacing=0.02, slope=0.25, largest=0.1),
    "finest": Resolution(spacing=0.014, slope=0.25, largest=0.08),
}


def thin(candidates: Floats, radii: Floats, kept: Floats | None = None) -> Bools:
    """Choose a maximal Poisson-disk subset of candidates; earlier candidates take precedence.

    Parameters
    ----------
    candidates : (n, 3) float64
        Points to choose from.
    radii : (n,) float64
        A candidate is chosen only if no point chosen before it is nearer than its radius.
    kept : (k, 3) float64, optional
        Points that are chosen already.

    Returns
    -------
    (n,) bool
        Whether each candidate is chosen.
    """
    chosen = np.zeros(len(candidates), dtype=bool)
    open_ = np.arange(len(candidates))
    if kept is not None and len(kept):
        open_ = open_[cKDTree(kept).query(candidates)[0] >= radii]
    while open_.size:
        # A candidate wins the round if no earlier neighbor is inside its disk; the first always wins.
        distance, neighbor = cKDTree(candidates[open_]).query(candidates[open_], k=min(_NEIGHBORS, open_.size))
        distance, neighbor = np.reshape(distance, (open_.size, -1)), np.reshape(neighbor, (open_.size, -1))
        order = np.arange(open_.size)
        wins = ~((distance < radii[open_, None]) & (neighbor < order[:, None])).any(axis=1)
        if not wins.all():
            # Where a disk contains more candidates than the neighbors looked at, winners may still conflict.
            wins[wins] = thin(candidates[open_[wins]], radii[open_[wins]])
        chosen[open_[wins]] = True
        winners = candidates[open_[wins]]
        rest = open_[~wins]
        open_ = rest[cKDTree(winners).query(candidates[rest])[0] >= radii[rest]] if rest.size else rest
    return chosen


def sample_surface(
    points: Floats, faces: Ints, spacing: float, rng: Generator, size: SizeField | None = None
) -> Floats:
    """(k, 3) Poisson-disk samples of triangles (m, 3) and of vertices (n, 3), at least ``spacing`` apart.

    If a ``size`` is given, they are apart by its value at each place, which must be at least the spacing.
    """
    corners = points[faces]
    sizes = areas(points, faces)
    total = float(sizes.sum())
    count = min(int(np.ceil(_OVERSAMPLING * total / spacing**2)), _MOST_CANDIDATES)
    samples = np.empty((0, 3))
    if count:
        triangle = rng.choice(len(faces), size=count, p=sizes / total)
        weights = rng.dirichlet((1.0, 1.0, 1.0), size=count)
        samples = np.einsum("nk,nka->na", weights, corners[triangle])
        if size is not None:
            samples = samples[rng.random(count) < (spacing / size(samples)) ** 2]
        samples = samples[thin(samples, _radii(samples, spacing, size))]
    vertices = rng.permutation(points)
    vertices = vertices[without_piles(vertices, _NEIGHBORS)]
    apart: Floats = vertices[thin(vertices, _radii(vertices, spacing, size), samples)]
    return np.concatenate([samples, apart])


def _radii(positions: Floats, spacing: float, size: SizeField | None) -> Floats:
    return np.full(len(positions), spacing) if size is None else size(positions)


def sample_cube(surface: Floats, size: SizeField, rng: Generator, widest_cell: float = np.inf) -> Floats:
    """Sample the corners, edges, faces and inside of the cube around given samples of the surface.

    Parameters
    ----------
    surface : (k, 3) float64
        Samples of the surface, strictly inside the cube; all are kept.
    size : callable
        Target distance between samples at positions (n, 3).
    rng : Generator
    widest_cell : float
        The cube is sampled cell by cell, with the density in the middle of each; where the density changes fast, as
        around a surface with edges of very different lengths, cells wider than so many target distances are divided.

    Returns
    -------
    (n, 3) float64
        All samples; those on the cube's faces have coordinates that are exactly 0 or 1.
    """
    samples: Floats = np.concatenate([_corners(), surface])
    for dimension in (1, 2, 3):
        candidates = _candidates(dimension, size, rng, widest_cell)
        radii = size(candidates)
        # Samples that are not on the cube's faces keep a distance from them, to avoid flat tetrahedra along the faces.
        gap = np.minimum(candidates, 1.0 - candidates)
        free = ((gap == 0.0) | (gap >= 0.6 * radii[:, None])).all(axis=1)
        candidates, radii = candidates[free], radii[free]
        samples = np.concatenate([samples, candidates[thin(candidates, radii, samples)]])
    return samples


def _corners() -> Floats:
    return _lattice(np.array([0.0, 1.0]), 3)


def _lattice(ticks: Floats, dimension: int) -> Floats:
    lattice: Floats = np.stack(np.meshgrid(*[ticks] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    return lattice


def _candidates(dimension: int, size: SizeField, rng: Generator, widest_cell: float) -> Floats:
    """Random points in random order on the cube's edges (1), faces (2) or inside (3), with the density of ``size``."""
    parts = []
    for free, fixed in _pieces(dimension):
        cells = _CELLS
        corners = _lattice(np.arange(cells) / cells, dimension)
        while len(corners):
            origin = np.broadcast_to(fixed, (len(corners), 3)).copy()
            origin[:, free] = corners
            middle = origin.copy()
            middle[:, free] += 0.5 / cells
            wanted = size(middle)
            wide = (1.0 / cells > widest_cell * wanted) & (cells < _MOST_CELLS)
            expected = _OVERSAMPLING * (1.0 / cells / wanted[~wide]) ** dimension
            count = np.floor(expected + rng.random(len(expected))).astype(np.int64)
            points = np.repeat(origin[~wide], count, axis=0)
            points[:, free] += rng.random((len(points), dimension)) / cells
            parts.append(points)
            cells *= 2
            corners = (corners[wide, None] + _lattice(np.array([0.0, 1.0]) / cells, dimension)).reshape(-1, dimension)
    candidates: Floats = np.concatenate(parts)
    return rng.permutation(candidates)


def _pieces(dimension: int) -> list[tuple[list[int], Floats]]:
    """The cube's edges, faces or inside, each as its free axes and a point with the coordinates of the fixed ones."""
    pieces = []
    for corner in _corners():
        for free in ([0], [1], [2]) if dimension == 1 else ([0, 1], [0, 2], [1, 2]) if dimension == 2 else ([0, 1, 2],):
            if not corner[free].any():
                pieces.append((free, corner))
    return pieces
