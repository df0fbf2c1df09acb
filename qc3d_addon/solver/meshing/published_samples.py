# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The samples of the cube that the paper takes: a uniform Poisson disk, of which samples are discarded at random.

Chen & Lui (arXiv 2308.05333), section 6.1: a sample is kept where a random number does not exceed a threshold, the
product of one factor that discards those near the vertices of the surface and an exponential, with the weight of
sparsity, that discards those far away. The paper gives no formula of the first factor; here it grows linearly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from ..arrays import Floats
from .poisson_disk import SizeField, sample_cube

_LARGEST = 0.25  # distance between samples, in sides of the cube, that moving them against slivers reckons with


@dataclass(frozen=True)
class Discarding:
    """The probability with which samples are kept, by their distance from the surface.

    Parameters
    ----------
    radius : float
        Of the Poisson disk, in sides of the cube.
    threshold : float
        In radii: samples nearer than that to the surface are kept in proportion to their distance.
    sparsity : float
        Samples at a distance d beyond that are kept with the probability exp(-sparsity d).
    """

    radius: float
    threshold: float
    sparsity: float

    def kept(self, distances: Floats) -> Floats:
        """(n,) probabilities for distances (n,) from the surface, in sides of the cube."""
        near = self.threshold * self.radius
        growing = np.minimum(distances / near, 1.0) if near > 0.0 else np.ones(len(distances))
        return np.asarray(growing * np.exp(-self.sparsity * np.maximum(distances - near, 0.0)))

    def around(self, surface: Floats) -> SizeField:
        """About the distance between the samples that are kept, as a function of position, for points (k, 3)."""
        tree = cKDTree(surface)

        def size(positions: Floats) -> Floats:
            beyond = np.maximum(tree.query(positions)[0] - self.threshold * self.radius, 0.0)
            # With a share p of them kept, samples in space are p to the power -1/3 times as far apart.
            return np.asarray(np.minimum(self.radius * np.exp(self.sparsity * beyond / 3.0), _LARGEST))

        return size


def sample_cube_as_published(surface: Floats, discarding: Discarding, rng: Generator) -> Floats:
    """The samples of the surface, the cube's corners, and what is kept of a uniform Poisson disk in the cube.

    Parameters
    ----------
    surface : (k, 3) float64
        Samples of the surface, strictly inside the cube; they are kept.
    discarding : Discarding
    rng : Generator

    Returns
    -------
    (n, 3) float64
        The samples; those on the cube's faces have coordinates that are exactly 0 or 1.
    """
    samples = sample_cube(surface, lambda positions: np.full(len(positions), discarding.radius), rng)
    given = 8 + len(surface)  # the cube's corners and the surface come first
    free = samples[given:]
    kept = rng.random(len(free)) < discarding.kept(np.asarray(cKDTree(surface).query(free)[0]))
    return np.concatenate([samples[:given], free[kept]])
