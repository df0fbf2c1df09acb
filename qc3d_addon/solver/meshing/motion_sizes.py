# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How large tetrahedra may be where: small where the motion between two keys asks for it, large elsewhere.

A map that is linear on each tetrahedron follows a motion well where the motion is nearly linear over the length of a
tetrahedron, as on a limb that turns as a whole, and badly at joints and across gaps between parts that move apart. How
far the motion is from linear is known beforehand, since both keys are: it is what the best affine map of the surface
within some radius leaves. If tetrahedra of the size h leave the error e(h), at a number of about h⁻² for each piece of
surface, the sum of squared errors is smallest for a given number where h e(h) is the same everywhere. That constant is
chosen such that there are as many tetrahedra as the resolution would give with the same size all over the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from ..arrays import Floats, Ints
from ..triangles.geometry import areas
from .poisson_disk import Resolution

_SLOPE, _LARGEST = 0.6, 0.2  # growth of tetrahedra away from the surface, and their largest size, cube units
_FINEST, _COARSEST, _LEVELS = 0.2, 2.0, 6  # sizes at the surface, in spacings of the resolution
_PLACES = 2_000  # on the surface, where sizes are decided
_MOST_SAMPLES = 5_000  # of the surface, where motions are compared
_NEIGHBORS = 20
_ON_A_SHEET = 9  # samples within a radius, on a flat piece of surface; a second sheet beside it fits in too
# What moves differently from what is around it needs tetrahedra that bring it there, even if it is rigid itself: this
# part of the motion's spread counts as error.
_SPREAD = 0.05
_LEAST_ERROR = 1e-6  # cube units; smaller ones make no difference
_AFFINE = 4  # numbers that an affine map has for each coordinate
_RIDGE = 1e-9  # for samples that lie in a plane; so small that what is affine stays below the least error
_LATTICE = 20  # cells along an edge of the cube, where tetrahedra are counted
_AROUND = 10  # places that limit one another's sizes
_HALVINGS = 12


@dataclass(frozen=True, eq=False)
class MotionSizes:
    """Distances between samples, by place.

    Parameters
    ----------
    tree : cKDTree
        Places (k, 3) on the surface, cube units.
    local : (k,)
        The distance between samples at each place.
    """

    tree: cKDTree
    local: Floats

    def __call__(self, positions: Floats) -> Floats:
        """(n,) distances between samples at positions (n, 3)."""
        return self._graded(*_nearest(self.tree, positions), self.local)

    @property
    def finest(self) -> float:
        """The smallest distance between samples."""
        return float(self.local.min())

    @staticmethod
    def _graded(far: Floats, near: Ints, local: Floats) -> Floats:
        sizes: Floats = np.minimum((local[near] + _SLOPE * far).min(axis=1), _LARGEST)
        return sizes

    @classmethod
    def of(
        cls, points: Floats, faces: Ints, moved: Floats | None, resolution: Resolution, rng: Generator
    ) -> MotionSizes:
        """Sizes for the motion from a shape to another.

        Parameters
        ----------
        points : (n, 3)
            Vertices inside the cube.
        faces : (m, 3) int64
            Triangles in any state; may be empty.
        moved : (n, 3) or None
            Where the vertices move to; None if that is not known. Sizes are then the same all over the surface, as they
            are where there are no triangles.
        resolution : Resolution
            Tells the number of samples: as many as it gives around the surface.
        rng : Generator

        Examples
        --------
        >>> from scipy.spatial import Delaunay
        >>> x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0.2, 0.8, 61), np.linspace(0.4, 0.6, 21)))
        >>> faces = Delaunay(np.stack([x, y], axis=1)).simplices
        >>> flat, bent = (np.stack([x, y, 0.5 + bend * np.maximum(x - 0.7, 0.0)], axis=1) for bend in (0.0, 0.5))
        >>> sizes = MotionSizes.of(flat, faces, bent, Resolution(0.03, 0.3, 0.12), np.random.default_rng(0))
        >>> bool(sizes(np.array([[0.7, 0.5, 0.5]]))[0] < 0.5 * sizes(np.array([[0.3, 0.5, 0.5]]))[0])
        True
        """
        samples, motions = _samples(points, faces, moved, rng)
        sizes = resolution.spacing * np.geomspace(_FINEST, _COARSEST, _LEVELS)
        places = samples[:_PLACES]
        costs = np.log(_errors(samples, motions, sizes, float(areas(points, faces).sum()), len(places)) * sizes)
        tree = cKDTree(places)
        apart, neighbors = _nearest(tree, places, _AROUND)
        lattice = (np.stack(np.meshgrid(*[np.arange(_LATTICE)] * 3), axis=-1).reshape(-1, 3) + 0.5) / _LATTICE
        far, near = _nearest(tree, lattice)
        wanted = (np.minimum(resolution.spacing + resolution.slope * far[:, 0], resolution.largest) ** -3.0).mean()

        def local(cost: float) -> Floats:
            found = _largest_sizes(costs, np.log(sizes), cost)
            for _ in range(_LEVELS):
                found = np.minimum(found, (found[neighbors] + _SLOPE * apart).min(axis=1))
            return np.asarray(found)

        low, high = float(costs.min()), float(costs.max())
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            many = (cls._graded(far, near, local(middle)) ** -3.0).mean() > wanted
            low, high = (middle, high) if many else (low, middle)
        return cls(tree, local(high))


def _nearest(tree: cKDTree, positions: Floats, count: int = 4) -> tuple[Floats, Ints]:
    """(n, c) distances to the nearest places, and their numbers."""
    far, near = tree.query(positions, k=np.arange(1, min(count, tree.n) + 1))
    return np.asarray(far, dtype=np.float64), np.asarray(near, dtype=np.int64)


def _samples(points: Floats, faces: Ints, moved: Floats | None, rng: Generator) -> tuple[Floats, Floats]:
    """(k, 3) random points of the surface and loose vertices, in random order, and their displacements (k, 3)."""
    motions = np.zeros_like(points) if moved is None else moved - points
    sizes = areas(points, faces)
    total = float(sizes.sum())
    loose = np.ones(len(points), dtype=bool)
    if total > 0.0:
        loose[faces[sizes > 0.0]] = False
    alone = rng.permutation(np.flatnonzero(loose))[:_MOST_SAMPLES]
    places, ways = points[alone], motions[alone]
    if total > 0.0:
        triangle = faces[rng.choice(len(faces), size=_MOST_SAMPLES, p=sizes / total)]
        weights = rng.dirichlet((1.0, 1.0, 1.0), size=_MOST_SAMPLES)
        places, ways = (
            np.concatenate([of_alone, np.einsum("nk,nka->na", weights, values[triangle])])
            for of_alone, values in ((places, points), (ways, motions))
        )
    order = rng.permutation(len(places))
    return places[order], ways[order]


def _errors(samples: Floats, motions: Floats, radii: Floats, area: float, count: int) -> Floats:
    """(count, R) what the best affine map within each radius leaves of the motion, cube units; growing with the radius.

    For each radius, motions are compared at so many of the samples that about as many lie within it.
    """
    found = np.full((count, len(radii)), _LEAST_ERROR)
    if area == 0.0:
        return found
    for level, radius in enumerate(radii):
        used = int(np.clip(_ON_A_SHEET * area / (np.pi * radius**2), 4 * _NEIGHBORS, len(samples)))
        if used <= _AFFINE:
            continue
        # Errors are asked for at the first of the samples: none of the others is nearer to one of these than itself.
        places, tree = samples[: min(used, count)], cKDTree(samples[:used])
        far, near = _nearest(tree, places, _NEIGHBORS)
        within = (far <= radius).astype(np.float64)
        offsets = (samples[near] - places[:, None]) / radius
        terms = np.concatenate([np.ones_like(offsets[..., :1]), offsets], axis=2) * within[..., None]
        ways = (motions[near] - motions[: len(places), None]) * within[..., None]
        normal = terms.transpose(0, 2, 1) @ terms + _RIDGE * np.eye(_AFFINE)
        loads = terms.transpose(0, 2, 1) @ ways
        whole = (ways**2).sum(axis=(1, 2))
        left = np.maximum(whole - (loads * np.linalg.solve(normal, loads)).sum(axis=(1, 2)), 0.0) + _SPREAD**2 * whole
        errors = np.sqrt(left / np.maximum(within.sum(axis=1) - _AFFINE, 1.0))
        if used < count:
            errors = errors[_nearest(tree, samples[:count], 1)[1][:, 0]]
        found[:, level] = np.maximum(errors, _LEAST_ERROR)
    return np.maximum.accumulate(found, axis=1)


def _largest_sizes(costs: Floats, sizes: Floats, cost: float) -> Floats:
    """(k,) the largest size at each place that costs no more; costs (k, R) and sizes (R,) are logarithms."""
    above = np.clip((costs < cost).sum(axis=1), 1, len(sizes) - 1)
    rows = np.arange(len(costs))
    before, after = costs[rows, above - 1], costs[rows, above]
    share = np.clip((cost - before) / np.maximum(after - before, 1e-12), 0.0, 1.0)
    return np.asarray(np.exp(sizes[above - 1] + share * (sizes[above] - sizes[above - 1])))
