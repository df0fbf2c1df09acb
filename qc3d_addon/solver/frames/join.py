# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several pairs in a row, A to B to C, without a stop or a jerk at the keys between.

At an inner key both neighbours get the mean of their rates: angular velocities and strain rates of the triangles and
growth of the volumes, so that lengths still hold. What little difference is left in the velocities of the vertices is
taken away by moving them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats
from ..surface.end_rates import Rates
from .natural import NaturalFrames

_VELOCITY_STEP = 0.02


def join(makers: Sequence[NaturalFrames]) -> list[NaturalFrames]:
    """Frames of consecutive pairs of one mesh, the second key of each being the first of the next, with equal
    velocities on both sides of every inner key; each pair takes the same time.

    What both keys of a pair leave in place has no velocity at either of them, so that it stays in place.
    """
    rates = [list(maker.end_rates()) for maker in makers]
    for left in range(len(makers) - 1):
        rates[left][1], rates[left + 1][0] = _shared_rates(makers, left, rates[left][1], rates[left + 1][0])
    last = len(makers) - 1
    joined = [
        maker.with_end_rates(first, second, (number > 0, number < last))
        for number, (maker, (first, second)) in enumerate(zip(makers, rates, strict=True))
    ]
    velocities = [[_velocity(maker, end) for end in (0, 1)] for maker in joined]
    slopes = [[np.zeros_like(velocity) for velocity in ends] for ends in velocities]
    for left in range(len(joined) - 1):
        before, after = velocities[left][1], velocities[left + 1][0]
        mean = 0.5 * (before + after)
        mean[joined[left].still | joined[left + 1].still] = 0.0
        slopes[left][1], slopes[left + 1][0] = mean - before, mean - after
    return [maker.with_end_slopes(first, second) for maker, (first, second) in zip(joined, slopes, strict=True)]


def _shared_rates(makers: Sequence[NaturalFrames], left: int, before: Rates, after: Rates) -> tuple[Rates, Rates]:
    """The mean of the rates on both sides of a key, for the triangles that both sides have."""
    _, mine, others = np.intersect1d(makers[left].rows, makers[left + 1].rows, return_indices=True)
    rests: Bools = makers[left].resting[mine] | makers[left + 1].resting[others]
    spins, strains = [before.spin.copy(), after.spin.copy()], [before.strain.copy(), after.strain.copy()]
    for own, (first, second) in ((spins, (before.spin, after.spin)), (strains, (before.strain, after.strain))):
        mean = 0.5 * (first[mine] + second[others])
        mean[rests] = 0.0
        own[0][mine], own[1][others] = mean, mean
    growth = [before.growth, after.growth]
    if np.array_equal(makers[left].components, makers[left + 1].components):
        growth = [0.5 * (before.growth + after.growth)] * 2
    return Rates(spins[0], strains[0], growth[0]), Rates(spins[1], strains[1], growth[1])


def _velocity(maker: NaturalFrames, end: int) -> Floats:
    """(n, 3) velocities at a key, 0 or 1, by one-sided differences of second order."""
    near, far = (maker.shape(abs(end - step * _VELOCITY_STEP)) for step in (1, 2))
    outward = (4.0 * near - far - 3.0 * maker.key(end)) / (2.0 * _VELOCITY_STEP)
    return np.asarray(outward if end == 0 else -outward)
