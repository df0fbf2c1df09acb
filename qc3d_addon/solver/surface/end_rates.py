# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast triangles turn and stretch at the ends of a path, and how to change that without moving the ends.

A quantity that goes from one value to another at a steady rate gets other rates at its ends by adding the two cubic
Hermite functions that vanish at both ends and have the slope 1 at one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..numerics.rotations import rotation_matrices
from ..numerics.symmetric_matrices import Stretch
from ..settings import StretchLaw


def hermite(time: float, slope0: Floats, slope1: Floats) -> Floats:
    """The cubic that vanishes at 0 and 1 and has there the slopes ``slope0`` and ``slope1``."""
    return np.asarray(time * (1.0 - time) ** 2 * slope0 + time**2 * (time - 1.0) * slope1)


@dataclass(frozen=True, eq=False)
class Rates:
    """Rates at one end of a path, per unit of its time.

    Parameters
    ----------
    spin : (m, 3)
        Angular velocities of the triangles, radians.
    strain : (m, 2, 2)
        Symmetric in-plane strain rates in the tangent bases of the triangles at that end.
    growth : (c,)
        Rates of the enclosed volumes of the components.
    """

    spin: Floats
    strain: Floats
    growth: Floats

    def toward(self, other: Rates) -> Rates:
        """What must be added to these rates to have the other ones."""
        return Rates(other.spin - self.spin, other.strain - self.strain, other.growth - self.growth)


@dataclass(frozen=True, eq=False)
class EndCorrection:
    """Slopes to add to a path's rotation vectors (m, 3), stretches (m, 2, 2) and volumes (c,) at its two ends."""

    turns: tuple[Floats, Floats]
    stretches: tuple[Floats, Floats]
    volumes: tuple[Floats, Floats]


def rotation_vector_rates(vectors: Floats, spins: Floats) -> Floats:
    """(m, 3) rates of rotation vectors (m, 3), angles below 2 pi, at which exp([q]x) spins with (m, 3) in space.

    The inverse of the left Jacobian of the exponential map of rotations.
    """
    angle = np.linalg.norm(vectors, axis=1)
    half = 0.5 * np.where(angle > 1e-4, angle, 1.0)
    second = np.where(angle > 1e-4, (1.0 - half / np.tan(half)) / (4.0 * half**2), 1.0 / 12.0)
    once = np.cross(vectors, spins)
    return np.asarray(spins - 0.5 * once + second[:, None] * np.cross(vectors, once))


def end_spins(swing: Floats, twist: Floats) -> tuple[Floats, Floats]:
    """(m, 3) angular velocities at 0 and at 1 of exp(t swing) exp(t twist)."""
    turned = np.einsum("kij,kj->ki", rotation_matrices(swing), twist)
    return swing + twist, swing + turned


def stretch_slopes(stretch: Stretch, law: StretchLaw) -> tuple[Floats, Floats]:
    """(m, d, d) derivatives of the interpolated stretch at 0 and at 1."""
    if law == "linear":
        slope = stretch.assembled(stretch.values - 1.0)
        return slope, slope
    logarithms = np.log(stretch.values)
    return stretch.assembled(logarithms), stretch.assembled(stretch.values * logarithms)


def strain_of_slope(stretch: Stretch, slope: Floats) -> Floats:
    """(m, d, d) symmetric part of dP/dt P^-1: the strain rate of a stretch P that changes by ``slope``."""
    rate = slope @ stretch.assembled(1.0 / stretch.values)
    return np.asarray(0.5 * (rate + rate.transpose(0, 2, 1)))


def slope_of_strain(stretch: Stretch, strain: Floats) -> Floats:
    """(m, d, d) symmetric dP/dt whose strain rate is ``strain``: the inverse of ``strain_of_slope``."""
    vectors = stretch.vectors
    inverse = 1.0 / stretch.values
    within = vectors.transpose(0, 2, 1) @ strain @ vectors
    within = 2.0 * within / (inverse[:, :, None] + inverse[:, None, :])
    return np.asarray(vectors @ within @ vectors.transpose(0, 2, 1))
