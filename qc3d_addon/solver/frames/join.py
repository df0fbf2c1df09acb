# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Joins the pairs of a chain, so that the motion goes through the inner keys without a stop or a jerk.

At an inner key, both adjacent pairs get the mean of their rates over the time that both take: angular velocities and
strain rates of the triangles, and growth rates of the volumes. This keeps lengths, and, since no rate exceeds what the
two pairs have together, a short pair beside a long one does not make the motion overshoot. All pairs are drawn to one
course through all keys, which tells where parts are and when. The small differences that remain between the velocities
of the vertices are removed by displacing the vertices themselves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats
from ..surface.end_rates import Rates
from .course import courses
from .natural import NaturalFrames
from .volume_anchors import VELOCITY_STEP, end_velocity


def join(makers: Sequence[NaturalFrames], durations: Floats) -> list[NaturalFrames]:
    """Give consecutive pairs of one mesh equal velocities on both sides of inner keys.

    Still vertices of a pair have no velocity at its keys, so that they stay in place.

    Parameters
    ----------
    makers : sequence of NaturalFrames
        Of each pair; their rates and velocities are per unit of the pair's own time.
    durations : (pairs,)
        Time that each pair takes, in any unit.
    """
    shares = durations[:-1] / (durations[:-1] + durations[1:])
    rates = [list(maker.end_rates()) for maker in makers]
    for left in range(len(makers) - 1):
        rates[left][1], rates[left + 1][0] = _shared_rates(
            makers, left, rates[left][1], rates[left + 1][0], float(shares[left])
        )
    last = len(makers) - 1
    joined = [
        maker.with_end_rates(first, second, (number > 0, number < last))
        for number, (maker, (first, second)) in enumerate(zip(makers, rates, strict=True))
    ]
    keys = np.stack([maker.key(0) for maker in makers] + [makers[-1].key(1)])
    shares_of_course = [maker.course_share() for maker in makers]
    along = courses(keys, durations, [maker.still for maker in makers], shares_of_course)
    joined = [maker.along(course) for maker, course in zip(joined, along, strict=True)]
    velocities = [[_velocity(maker, end) for end in (0, 1)] for maker in joined]
    slopes = [[np.zeros_like(velocity) for velocity in ends] for ends in velocities]
    for left in range(len(joined) - 1):
        before, after = velocities[left][1], velocities[left + 1][0]
        both = before + after
        both[joined[left].still | joined[left + 1].still] = 0.0
        slopes[left][1] = shares[left] * both - before
        slopes[left + 1][0] = (1.0 - shares[left]) * both - after
    return [maker.with_end_slopes(first, second) for maker, (first, second) in zip(joined, slopes, strict=True)]


def _shared_rates(
    makers: Sequence[NaturalFrames], left: int, before: Rates, after: Rates, share: float
) -> tuple[Rates, Rates]:
    """Rates on both sides of a key, averaged for the triangles that both sides have.

    ``share`` is the part, 0..1, of the time of both pairs that the pair before the key takes.
    """
    _, mine, others = np.intersect1d(makers[left].rows, makers[left + 1].rows, return_indices=True)
    rests: Bools = makers[left].resting[mine] | makers[left + 1].resting[others]
    spins, strains = [before.spin.copy(), after.spin.copy()], [before.strain.copy(), after.strain.copy()]
    for own, (first, second) in ((spins, (before.spin, after.spin)), (strains, (before.strain, after.strain))):
        both = first[mine] + second[others]
        both[rests] = 0.0
        own[0][mine], own[1][others] = share * both, (1.0 - share) * both
    growth = [before.growth, after.growth]
    if np.array_equal(makers[left].components, makers[left + 1].components):
        both = before.growth + after.growth
        growth = [share * both, (1.0 - share) * both]
    return Rates(spins[0], strains[0], growth[0]), Rates(spins[1], strains[1], growth[1])


def _velocity(maker: NaturalFrames, end: int) -> Floats:
    """(n, 3) velocities at the first (0) or second (1) key, by one-sided differences of second order."""
    near, far = (maker.shape(abs(end - step * VELOCITY_STEP)) for step in (1, 2))
    return end_velocity(near, far, maker.key(end), end)
